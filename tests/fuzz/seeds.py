#!/usr/bin/env python3
"""Writes the seed corpora: corpus/TARGET/NAME, small, all of our own making. Run again when a format changes."""
import os
import re
import struct
import sys
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
HOUSE = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(HOUSE, "messages"))
sys.dont_write_bytecode = True
from definition import read_definition  # noqa: E402


def save(target, name, content):
    folder = os.path.join(HERE, "corpus", target)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name), "wb") as file:
        file.write(content if isinstance(content, bytes) else content.encode())


# MAVLink

def crc(data):
    value = 0xFFFF
    for byte in data:
        for bit in range(8):
            carry = (value ^ byte >> bit) & 1
            value = value >> 1 ^ (0x8408 if carry else 0)
    return value


def frame(version, message, extra, payload, sequence=0, system=1, component=1, signed=False):
    if version == 1:
        body = bytes([len(payload), sequence, system, component, message]) + payload
    else:
        body = bytes([len(payload), int(signed), 0, sequence, system, component]) + struct.pack("<I", message)[:3] + payload
    start = b"\xfe" if version == 1 else b"\xfd"
    return start + body + struct.pack("<H", crc(body + bytes([extra]))) + (b"\x5a" * 13 if signed else b"")


HEARTBEAT, ATTITUDE, TIMESYNC, COMMAND_LONG = (0, 50), (30, 39), (111, 34), (76, 152)
attitude = struct.pack("<I6f", 1000, 0.1, -0.2, 1.5, 0.0, 0.01, -0.01)
raw = b"\x00"  # the first byte: the rest is a stream as it is
save("mavlink", "version1", raw + frame(1, *HEARTBEAT, bytes(9)) + frame(1, *ATTITUDE, attitude, 1))
save("mavlink", "version2", raw + frame(2, *HEARTBEAT, bytes(9)) + frame(2, *ATTITUDE, attitude, 1))
save("mavlink", "signed", raw + frame(2, *ATTITUDE, attitude, signed=True) + frame(2, *HEARTBEAT, b"\0", 1, signed=True))
save("mavlink", "unknown", raw + frame(2, 12345, 7, bytes(20)) + frame(2, *HEARTBEAT, bytes(9), 1))
save("mavlink", "broken", raw + frame(2, *ATTITUDE, attitude)[:-5] + frame(2, *HEARTBEAT, bytes(9), 1))
save("mavlink", "command", raw + frame(2, *COMMAND_LONG, struct.pack("<7fH3B", 1, 0, 0, 0, 0, 0, 0, 400, 1, 191, 0), system=255))
# the first byte odd: a script (mavlink_fuzz.cpp: 0 bytes, 1 time passes, 2 we ask for the time, 3 restart, else a frame)
rows = [m.id for m in read_definition(os.path.join(HOUSE, "messages/wasp.xml")).messages]
heard = [0, 4, 26, 27, 30, 31, 75, 76, 77, 105, 111, 253]  # by the link
for part in range(2):  # full of a payload that reads as numbers
    frames = (struct.pack("<BBHBB15f", 4, 4, rows.index(i), 60, i, *[0.5] * 15) for i in heard[part::2])
    save("mavlink", f"script_messages{part}", b"\x01" + b"".join(frames))
def signed_beat(sequence, time):  # the script asks for a good signature (32), how: version 2, signed, own length
    return struct.pack("<BBHBB", 4, 2 | 4 | 32, rows.index(0), 9, sequence) + bytes(9) + struct.pack("<H", time)


save("mavlink", "script_signed", b"\x01" + signed_beat(0, 2000) + signed_beat(1, 2001) + signed_beat(2, 2001) + signed_beat(3, 3000))
ask = bytes([1]) + struct.pack("<I", 7_000_000) + b"\x02"
save("mavlink", "script_clock", b"\x01" + (ask + struct.pack("<BBHB", 4, 0, rows.index(111), 0) + struct.pack("<qq", 10**12, 7_000_000)) * 4)

# Recorded logs and message descriptions; the first byte: even a log, odd a description
beats = [frame(2, *HEARTBEAT, bytes(8) + bytes([i + 1]), i) for i in range(4)]
times = [1_700_000_000_000_000 + 253254 * i for i in range(4)]
save("mavlink_log", "raw", raw + b"".join(beats))
save("mavlink_log", "tlog", raw + b"".join(struct.pack(">Q", t) + b for t, b in zip(times, beats)))
save("mavlink_log", "tlog_low_first", raw + b"".join(struct.pack("<Q", t) + b for t, b in zip(times, beats)))
save("mavlink_log", "torn", raw + beats[0] + beats[1][:-4] + struct.pack(">Q", times[2]) + beats[2] + beats[3][:7])
save("mavlink_log", "unknown", raw + beats[0] + frame(2, 20001, 1, b"abc", 1) + beats[2])
save("mavlink_log", "signed_cut", raw + frame(2, *HEARTBEAT, bytes(9), 0, signed=True) + frame(2, *HEARTBEAT, bytes(9), 1, signed=True)[:-5] + beats[2])
save("mavlink_log", "dataflash", raw + b"\xa3\x95\x80\x80")
field = '{"name":"%s","type":"%s","offset":%d,"array_length":%d,"extension":%s}'
fields = ",".join([field % ("a", "double", 0, 0, "false"), field % ("b", "int16_t", 8, 2, "false"), field % ("c", "char", 12, 4, "true")])
save("mavlink_log", "description", b"\x01" + ('{"messages":[{"id":1,"name":"A","crc_extra":2,"min_length":12,"max_length":16,"fields":[%s]}]}' % fields).encode())

# Configurations: each section of ours alone, and the whole without its comments


def toml_seeds(target, path):
    with open(os.path.join(HOUSE, path), encoding="utf-8") as file:
        lines = [re.sub(r"\s+#.*", "", line).rstrip() for line in file]
    lines = [line for line in lines if line and not line.startswith("#")]
    save(target, "whole", "\n".join(lines) + "\n")
    sections = re.split(r"\n(?=\[)", "\n".join(lines))
    for section in sections:
        name = re.sub(r"\W+", "_", section.splitlines()[0]).strip("_")
        save(target, name or "head", section + "\n")
    words = sorted({word for line in lines for word in re.findall(r'^\[.*\]|^\w+ =|"\w+"', line)})
    with open(os.path.join(HERE, target + ".dict"), "w", encoding="utf-8") as file:
        file.write("# written by seeds.py\n")
        for word in words:
            file.write('"' + word.replace('"', '\\"') + '"\n')


toml_seeds("flight_config", "config/wasp.toml")
toml_seeds("sim_config", "config/sim.toml")
for target in ("flight_config", "sim_config"):
    save(target, "odd_numbers", '[camera]\nwidth_px = 1e300\nheight_px = -nan\nfx_px = 0x7fffffffffffffff\ncx_px = inf\n')
    save(target, "odd_text", '[run]\n"a.b" = 1979-05-27T07:32:00Z\nx = """\n\\u00e9"""\ny = [1, [2.0], {z = true}]\n')

# Faults; the first byte: even a live camera, odd a replay
POINTS = re.findall(r'"([a-z]+\.[a-z_]+)"', open(os.path.join(HOUSE, "scheduling/fault_points.cpp"), encoding="utf-8").read())
POINTS = sorted(set(POINTS))
fault = '[[fault]]\nat_s = 5.0\nafter = "flying"\nwhat = "%s"\nfor_s = 0.5\n'
save("fault_timeline", "every_point", "\0" + "".join(fault % point for point in POINTS))
save("fault_timeline", "replay", "\1" + "".join(fault % point for point in POINTS[-3:]))
save("fault_timeline", "value", "\0" + fault % POINTS[0] + 'value = 1e39\nbehaviour = "avoid"\n')
save("fault_timeline", "odd", "\0fault = [1, {at_s = nan, what = 3}]\n")
for point in POINTS:
    save("fault_request", point, f"\0inject {point} for 0.5 value 1 behaviour avoid")
for name, text in (("clear", "clear"), ("clear_one", f"clear {POINTS[0]}"), ("list", "list\n"), ("status", "status"),
                   ("odd", "inject \x1b[31m for 1e999 value nan"), ("long", "inject " + "x" * 600)):
    save("fault_request", name, "\0" + text)
for target, words in (("fault_timeline", ["[[fault]]", "at_s = ", "after = ", "what = ", "for_s = ", "value = ", "behaviour = ", "start",
                                          "armed", "flying", "landing"]),
                      ("fault_request", ["inject ", "clear ", "list", "status", " for ", " value ", " behaviour ", "ground_altitude"])):
    with open(os.path.join(HERE, target + ".dict"), "w", encoding="utf-8") as file:
        file.write("# written by seeds.py\n" + "".join(f'"{word}"\n' for word in words + POINTS))

# Images and recordings


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, depth, colour, rows, interlace=0, more=b""):
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + more + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def row(content):
    return b"\x00" + content


PNG, PGM = b"\x02", b"\x01"  # the first byte: which reader, and (2) make the checksums right
save("image", "gray8", PNG + png(4, 2, 8, 0, row(b"\1\2\3\4") * 2))
save("image", "gray16", PNG + png(2, 2, 16, 0, row(b"\1\2\3\4") * 2))
save("image", "gray1", PNG + png(9, 2, 1, 0, row(b"\xaa\x80") * 2))
save("image", "rgb", PNG + png(2, 2, 8, 2, row(bytes(range(6))) * 2))
save("image", "rgba16", PNG + png(1, 2, 16, 6, row(bytes(range(8))) * 2))
save("image", "palette", PNG + png(4, 1, 2, 3, row(b"\x1b"), more=chunk(b"PLTE", bytes(range(12))) + chunk(b"tRNS", b"\x80")))
save("image", "interlaced", PNG + png(2, 2, 8, 0, row(b"\1") + row(b"\2") + row(b"\3\4"), interlace=1))
save("image", "huge", PNG + png(16384, 16384, 8, 0, row(b"\1\2\3\4")))
save("image", "pgm8", PGM + b"P5\n# a comment\n3 2\n255\n\1\2\3\4\5\6")
save("image", "pgm16", PGM + b"P5 2 2 65535\n\1\2\3\4\5\6\7\x08")
save("image", "pgm_huge", PGM + b"P5 16384 16384 65535\n\1\2")


def folder(*files):
    """Pairs of name and content as recording_fuzz.cpp takes them: the row of the name, and a text or the row of an image."""
    out = b""
    for name, what in files:
        if isinstance(what, int):
            out += bytes([name, what])
        else:
            padded = what.encode() + b"\n" * (-len(what) % 4)
            out += bytes([name, len(padded) // 4]) + padded
    return out


CAMERA = 'width_px = 4\nheight_px = 3\nfx_px = 3.5\nfy_px = 3.5\ncx_px = 1.5\ncy_px = 1\nlens = "fisheye"\nfisheye_k = [0, 0.1, 0, 0]\n' \
         'pitch_down_deg = 30\nrate_hz = 30\nposition_body_m = [0.1, 0, 0]\ndepth_units_per_m = 5000\nk1 = 0.1\n'
save("recording", "tum", folder((0, "1305031102.160407 frame-000000.depth.png\n1305031102.194330 frame-000007.depth.png"),
                                (1, "# rgb\n1305031102.175304 test1.png"), (2, CAMERA), (4, 0), (5, 0), (14, 1)))
save("recording", "7scenes", folder((4, 0), (5, 0)))
save("recording", "pair", folder((6, 0), (7, 0), (8, 1)))
save("recording", "pgm", folder((9, 4), (10, 4), (11, 1)))
save("recording", "named", folder((12, 0), (13, 1)))
save("recording", "hover", folder((3, "frame,t_s,x\n1,0.01\n2,0.03\n"), (14, 1), (15, 1)))
save("recording", "asl", folder((17, 1), (19, 1)))
save("recording", "asl_late", folder((17, 1), (18, 1)))
save("recording", "numbered", folder((20, 1), (21, 1)))
save("recording", "odd_times", folder((3, "frame,t_s,x\n1,-1e300\n2,1e300\n"), (14, 1), (15, 1)))
save("recording", "far_times", folder((0, "-9223372036.854775808 frame-000000.depth.png\n9223372036.854775807 frame-000007.depth.png"),
                                      (4, 0), (5, 0)))
save("recording", "tum_motion", folder((1, "# freiburg2\r\n1.0 test1.png\r\n1.1 test002.png"), (14, 1), (15, 1), (2, CAMERA),
                                       (26, "1.0 1 2 3 0 0 0 1\n1.1 1 2 3 0 0 0.0998 0.995\n1.05 0 0 0 0 0 0 2"),
                                       (28, "exposed_at_ns,a\n1000000000,0,0,0,0,-9.8,0.1,0.2,0.3\n1005000000,0,0,0,0,-9.8,0.1,0.2,0.3")))
save("recording", "accelerometer", folder((1, "1.0 test1.png"), (14, 1), (27, "# t a a a\n1.0 0.1 -9.8 0.2\n1.0 0 0 0\n0.5 x 1 1")))
save("recording", "7scenes_poses", folder((4, 0), (5, 0), (22, 1), (32, "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1"), (33, "1 0 0\n")))
save("recording", "euroc", folder((17, 1), (30, "#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n1,2,3"),
                                  (31, "T_BS:\n  data: [0, -1, 0, 0, 1, 0, 0, 0,\n 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [4, 3]\n"
                                       "camera_model: pinhole\nintrinsics: [3, 3, 1, 1] # fu\ndistortion_model: radtan\n"
                                       "distortion_coefficients: [0.1, 0, 0, 0]")))
save("recording", "rawseeds", folder((25, 1)))
save("recording", "capture", folder((3, "frame,t_s,x\n1,0.01\n2,0.03\n1,0.02\n9,1"), (14, 1), (15, 1),
                                    (29, "time_s,latest_image_frame,X,Y,Z,qx,qy,qz\n0.01,0,0,0,1,0,0,0.1\n0.02,1,0,0,1,0,0,0.1\n0.03,2,0,0,1,9,0,0")))
FLO = struct.pack("<fii", 202021.25, 4, 3) + struct.pack("<24f", *[0.5] * 24)
save("recording", "middlebury", folder((23, 1), (24, 1)) + bytes([34, len(FLO) // 4]) + FLO)
save("recording", "elsewhere", folder((1, "1.0 /dev/null\n2.0 ../x.png\n3.0 .")))

# Shared memory: changes (u16 place, u8 length, bytes) to a good region; the first byte: another length in 128ths


def changes(*rows, length=0):
    return bytes([length]) + b"".join(struct.pack("<HB", at, len(content)) + content for at, content in rows)


FIRST_TOPIC, TOPIC_BYTES = 192, 96
save("region", "good", changes())
save("region", "short", changes(length=64))
save("region", "long", changes(length=200))
save("region", "version", changes((8, struct.pack("<I", 3))))
save("region", "count", changes((12, struct.pack("<I", 2**32 - 1))))
for place, name in ((64, "kind"), (68, "slots"), (72, "payload"), (80, "offset"), (88, "bytes")):
    for value in (0, 1, 64, 2**32 - 1):
        save("region", f"{name}_{value}", changes((FIRST_TOPIC + place, struct.pack("<I", value))))
save("region", "names", changes((FIRST_TOPIC, b"x" * 40), (FIRST_TOPIC + TOPIC_BYTES, b"small\0")))
save("region", "published", changes((4096, b"\xff" * 8)))

# Worlds
HEAD = "#VRML V2.0 utf8\n"
FACE = "geometry IndexedFaceSet { coord Coordinate { point [0 0 0, 1 0 0, 1 1 0, 0 1 0] } coordIndex [0, 1, 2, 3, -1]%s }"
TEXTURED = " texCoord TextureCoordinate { point [0 0, 1 0, 1 1, 0 1] } texCoordIndex [0 1 2 3 -1]"
LOOK = "appearance Appearance { material Material { diffuseColor 0.5 0.4 0.3 } texture PixelTexture { image 2 2 1 0 255 128 64 } }"
MOVING = """DEF M Transform { children Shape { %s } }
DEF T TimeSensor { cycleInterval 4 loop TRUE }
DEF P PositionInterpolator { key [0, 0.5, 1] keyValue [0 0 0, 1 0 0, 0 0 0] }
DEF O OrientationInterpolator { key [0 1] keyValue [0 1 0 0, 0 1 0 1] }
ROUTE T.fraction_changed TO P.set_fraction
ROUTE P.value_changed TO M.set_translation
ROUTE T.fraction_changed TO O.set_fraction
ROUTE O.value_changed TO M.set_rotation
"""
save("vrml", "face", HEAD + "Shape { " + FACE % TEXTURED + " " + LOOK + " }\n")
save("vrml", "moving", HEAD + MOVING % (FACE % ""))
save("vrml", "solids", HEAD + "Transform { translation 1 2 3 rotation 0 1 0 1 scale 2 2 2 children [ Shape { geometry Box { size 1 2 3 } } "
     "Shape { geometry Cone { } } Shape { geometry Cylinder { } } Shape { geometry Sphere { } } ] }\n")
save("vrml", "grid", HEAD + "Shape { geometry ElevationGrid { xDimension 2 zDimension 3 xSpacing 1 zSpacing 2 height [0 1 2 3 4 5] } }\n")
save("vrml", "extrusion", HEAD + "Shape { geometry Extrusion { crossSection [1 1, 1 -1, -1 -1, 1 1] spine [0 0 0, 0 1 0, 1 2 0] scale [1 1, 2 2, 1 1] } }\n")
save("vrml", "names", HEAD + "DEF A Group { children [ DEF B Shape { " + FACE % "" + " } USE B ] }\nUSE A\n")
save("vrml", "proto", HEAD + "PROTO P [ field SFVec3f s 1 1 1 ] { Shape { geometry Box { size IS s } } }\nP { s 2 2 2 }\nInline { url \"a.wrl\" }\n")
save("vrml", "misplaced", HEAD + "Shape { geometry Box { } }\nShape { geometry WorldInfo { title \"inside\" } }\nShape { appearance Transform { } }\n")
save("vrml", "head", HEAD + 'WorldInfo { title "t" info [ "wasp: light is baked into the colours; exposure 1.5" "wasp: surfaces are smooth" ] }\n'
     "Background { skyColor [0.2 0.3 0.4] }\nViewpoint { position 1 2 3 orientation 0 1 0 1 }\nShape { " + FACE % " colorPerVertex FALSE color Color { color [1 0 0] } colorIndex [0]" + " }\n")
save("vrml", "picture", HEAD + 'Shape { appearance Appearance { texture ImageTexture { url ["absent.png"] } } ' + FACE % "" + " }\n")
save("vrml", "lod", HEAD + "LOD { range [1] level [ Group {} Shape { " + FACE % "" + " } ] }\nSwitch { whichChoice 0 choice [ Shape { geometry Box { } } ] }\nBillboard { children Shape { geometry Box {} } }\n")
WORDS = """Shape Appearance Material ImageTexture PixelTexture TextureTransform IndexedFaceSet IndexedLineSet PointSet Coordinate Normal Color
TextureCoordinate Box Cone Cylinder Sphere ElevationGrid Extrusion Text Transform Group Switch LOD Inline Anchor Billboard Collision TimeSensor
PositionInterpolator OrientationInterpolator Viewpoint Background WorldInfo Script PROTO EXTERNPROTO DEF USE ROUTE TO IS field exposedField
eventIn eventOut children geometry appearance coord coordIndex texCoord texCoordIndex normal normalIndex color colorIndex point image url key
keyValue crossSection spine scale orientation height xDimension zDimension TRUE FALSE NULL -1 1e38 2147483647 32767""".split()
with open(os.path.join(HERE, "vrml.dict"), "w", encoding="utf-8") as out:
    out.write("# written by seeds.py\n" + "".join(f'"{word} "\n' for word in WORDS) + '"#VRML V2.0 utf8\\x0a"\n"{"\n"}"\n"["\n"]"\n')
