// Compares wasp's MAVLink codec with node-mavlink, over every message both know, in both directions, byte for byte:
//   ours -> theirs: our frames pass their parser, decode to the fields we wrote, and encode to the same bytes;
//   theirs -> ours: their frames pass our parser, decode to the fields they wrote, and encode to the same bytes.
// One difference is known and handled by name: node-mavlink sends an all-zero payload with length 0 where the rule
// (never below 1) asks for one zero byte. Everything else counts as a failure. The same signed: each side verifies the
// other's signatures, and refuses them under another key.
// usage: node interop.cjs FOLDER_OF_NODE_MODULES PATH_OF_WASP_INTEROP_FRAMES [SEED] [COUNT]
const path = require("path");
const { execFileSync } = require("child_process");
const { PassThrough } = require("stream");
const [, , modules, program, seedText = "1", countText = "40"] = process.argv;
const load = (name) => require(path.join(path.resolve(modules), "node_modules", name));
const mappings = load("mavlink-mappings");
const { MavLinkProtocolV1, MavLinkProtocolV2, MavLinkPacketSplitter, MavLinkPacketParser } = load("node-mavlink");
const dialects = [mappings.minimal, mappings.standard, mappings.common, mappings.ardupilotmega];
const registry = Object.assign({}, ...dialects.map((dialect) => dialect.REGISTRY));
const seed = Number(seedText), count = Number(countText);
const key = Buffer.from(Array.from({ length: 32 }, (_, i) => i)), otherKey = Buffer.alloc(32, 7);
const v2 = new MavLinkProtocolV2(1, 191), v1 = new MavLinkProtocolV1(1, 191);

let failures = 0;
function expect(condition, text) {
  if (condition) return;
  if (++failures <= 20) console.error("FAIL " + text);
}

// ---- values ----
const isText = (field) => field.type === "char[]";
const is64 = (field) => /^u?int64_t/.test(field.type);
const isFloat = (field) => /^(float|double)/.test(field.type);

function fromJson(field, value) {
  const one = (x) => (is64(field) ? BigInt(x) : x === "nan" ? NaN : x === "inf" ? Infinity : x === "-inf" ? -Infinity : x);
  if (isText(field)) return value;
  return Array.isArray(value) ? value.map(one) : one(value);
}
function same(a, b) {
  if (Array.isArray(a)) return Array.isArray(b) && a.length === b.length && a.every((x, i) => same(x, b[i]));
  return Object.is(a, b);
}
function compareFields(Message, got, want, what) {
  for (const field of Message.FIELDS)
    expect(same(got[field.name], want[field.name]), `${what} ${Message.MSG_NAME}.${field.source}: ${got[field.name]} for ${want[field.name]}`);
}

// ---- a seeded generator (mulberry32) and random messages ----
let state = seed >>> 0;
function random() {
  state = (state + 0x6d2b79f5) >>> 0;
  let t = state;
  t = Math.imul(t ^ (t >>> 15), t | 1);
  t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
  return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
}
const below = (n) => Math.floor(random() * n);
function randomScalar(field) {
  const kind = below(10);
  if (kind < 3) return is64(field) ? 0n : 0;
  if (isFloat(field)) {
    if (kind === 3) return NaN;
    if (kind === 4) return -Infinity;
    return Math.fround((below(2000001) - 1e6) * 2 ** (below(60) - 40));
  }
  const bits = Number(/(\d+)_t/.exec(field.type)[1]), signed = /^int/.test(field.type);
  let value = 0n;
  for (let i = 0; i < 8; ++i) value = (value << 8n) | BigInt(below(256));
  if (kind === 3) value = -1n;
  if (kind === 4) value = 1n << BigInt(bits - 1);
  value = signed ? BigInt.asIntN(bits, value) : BigInt.asUintN(bits, value);
  return is64(field) ? value : Number(value);
}
function randomField(field, zero) {
  if (isText(field)) {
    let text = "";
    for (let n = zero ? 0 : below(field.length + 1); n > 0; --n) text += String.fromCharCode(32 + below(95));
    return text;
  }
  const one = () => (zero ? (is64(field) ? 0n : 0) : randomScalar(field));
  return field.length > 0 ? Array.from({ length: field.length }, one) : one();
}
function randomMessage(Message, zero) {
  const message = new Message();
  for (const field of Message.FIELDS) message[field.name] = randomField(field, zero);
  return message;
}

// ---- the one known difference ----
let emptyPayloads = 0;
/** The frame as the rule wants it: a payload of length 0 becomes one zero byte, with a new checksum. */
function byTheRule(frame, Message) {
  if (frame[1] !== 0) return frame;
  ++emptyPayloads;
  const longer = Buffer.concat([frame.subarray(0, 10), Buffer.from([0, 0, 0])]);
  longer[1] = 1;
  longer.writeUInt16LE(mappings.x25crc(longer, 1, 2, Message.MAGIC_NUMBER), 11);
  return longer;
}

function run(args, input) {
  const text = execFileSync(program, args, { input, encoding: "utf8", maxBuffer: 1 << 30 });
  return text.split("\n").filter(Boolean).map((line) => JSON.parse(line));
}

/** Frames through node-mavlink's own splitter, which checks length and checksum. */
function splitByThem(frames) {
  return new Promise((resolve, reject) => {
    const packets = [], input = new PassThrough();
    input.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser())
      .on("data", (packet) => packets.push(packet)).on("end", () => resolve(packets)).on("error", reject);
    for (const frame of frames) input.write(frame);
    input.end();
  });
}

async function oursToTheirs() {
  const all = run(["write", String(seed), String(count)]);
  const unknown = [...new Set(all.filter((f) => !registry[f.id]).map((f) => f.name))];
  const known = all.filter((f) => registry[f.id]);
  const packets = await splitByThem(known.map((f) => Buffer.from(f.hex, "hex")));
  expect(packets.length === known.length, `their parser took ${packets.length} of ${known.length} frames`);
  packets.forEach((packet, i) => {
    const ours = known[i], Message = registry[ours.id];
    expect(packet.header.msgid === ours.id && packet.header.seq === ours.sequence, `header of ${ours.name}`);
    expect(packet.header.sysid === 1 && packet.header.compid === 191, `sender of ${ours.name}`);
    const decoded = packet.protocol.data(packet.payload, Message);
    const want = {};
    for (const field of Message.FIELDS) {
      expect(field.source in ours.fields, `${ours.name}.${field.source} is not among our fields`);
      want[field.name] = fromJson(field, ours.fields[field.source]);
    }
    expect(Object.keys(ours.fields).length === Message.FIELDS.length, `${ours.name}: number of fields`);
    compareFields(Message, decoded, want, "ours decoded by them:");
    const again = byTheRule(v2.serialize(decoded, ours.sequence), Message).toString("hex");
    expect(again === ours.hex, `${ours.name}: they encode ${again}, we ${ours.hex}`);
  });
  return { frames: known.length, ids: [...new Set(known.map((f) => f.id))], unknown };
}

function theirsToOurs(ids) {
  const sent = [];
  let sequence = 0;
  for (const id of ids) {
    for (let i = 0; i <= count; ++i) {
      const Message = registry[id], message = randomMessage(Message, i === 0);
      const frame = v2.serialize(message, (sequence = (sequence + 1) & 255));
      sent.push({ Message, message, frame, want: byTheRule(frame, Message).toString("hex") });
    }
  }
  const got = run(["read"], sent.map((s) => s.frame.toString("hex")).join("\n") + "\n");
  compareDecoded(sent, got, "theirs decoded by us:");
  return sent.length;
}

/** Version 1 has no extensions, and node-mavlink would send them: only messages without are compared. */
function theirsToOursVersion1(ids) {
  const sent = [];
  for (const id of ids.filter((n) => n < 256 && !registry[n].FIELDS.some((f) => f.extension))) {
    const Message = registry[id], message = randomMessage(Message, false);
    const frame = v1.serialize(message, id & 255);
    sent.push({ Message, message, frame, want: byTheRule(v2.serialize(message, id & 255), Message).toString("hex") });
  }
  const got = run(["read"], sent.map((s) => s.frame.toString("hex")).join("\n") + "\n");
  compareDecoded(sent, got, "version 1 decoded by us:");
  return sent.length;
}

function compareDecoded(sent, got, what) {
  expect(got.length === sent.length, `${what} we took ${got.length} of ${sent.length} frames`);
  got.forEach((ours, i) => {
    const { Message, message, want } = sent[i];
    const decoded = {};
    for (const field of Message.FIELDS) decoded[field.name] = fromJson(field, ours.fields[field.source]);
    compareFields(Message, decoded, message, what);
    expect(ours.hex === want, `${what} ${ours.name}: we encode ${ours.hex}, they ${want}`);
  });
}

/** Our signed frames pass their parser, and their SHA-256 finds our signatures right; under another key it does not. */
async function oursSigned() {
  const frames = run(["write", String(seed), "3", key.toString("hex")]).filter((f) => registry[f.id]);
  const packets = await splitByThem(frames.map((f) => Buffer.from(f.hex, "hex")));
  expect(packets.length === frames.length, `signed: their parser took ${packets.length} of ${frames.length} frames`);
  let last = 0;
  for (const packet of packets) {
    expect(packet.signature && packet.signature.matches(key), `signature of ours, id ${packet.header.msgid}`);
    expect(!packet.signature.matches(otherKey), `signature of ours under another key, id ${packet.header.msgid}`);
    expect(packet.signature.timestamp > last, "timestamps rise");
    last = packet.signature.timestamp;
  }
  return packets.length;
}

/** Their signed frames pass our check, and decode to what they wrote; unsigned ones and those of another key do not. */
function theirsSigned(ids) {
  const signing = new MavLinkProtocolV2(1, 191, MavLinkProtocolV2.IFLAG_SIGNED);
  const sent = [];
  for (const id of ids) {
    const Message = registry[id], message = randomMessage(Message, false), sequence = sent.length & 255;
    const want = byTheRule(v2.serialize(message, sequence), Message).toString("hex");
    const plain = signing.serialize(message, sequence);
    sent.push({ Message, message, want, plain, frame: signing.sign(plain, 9, key, Date.now() + sent.length) });
  }
  const lines = (frames) => frames.map((f) => f.toString("hex")).join("\n") + "\n";
  compareDecoded(sent, run(["read", key.toString("hex")], lines(sent.map((s) => s.frame))), "signed by them:");
  const wrong = sent.map((s, i) => signing.sign(s.plain, 9, otherKey, Date.now() + 1e6 + i));
  expect(run(["read", key.toString("hex")], lines(wrong)).length === 0, "we took frames of another key");
  const unsigned = sent.map((s) => Buffer.from(s.want, "hex"));
  expect(run(["read", key.toString("hex")], lines(unsigned)).length === 0, "we took unsigned frames");
  return sent.length;
}

(async () => {
  const ours = await oursToTheirs();
  const theirs = theirsToOurs(ours.ids);
  const version1 = theirsToOursVersion1(ours.ids);
  const signedOurs = await oursSigned(), signedTheirs = theirsSigned(ours.ids.filter((id) => id !== 109));
  console.log(`messages both know: ${ours.ids.length}; only ours: ${ours.unknown.join(" ") || "none"}`);
  console.log(`frames ours -> theirs: ${ours.frames}; theirs -> ours: ${theirs}; theirs in version 1: ${version1}`);
  console.log(`signed frames ours -> theirs: ${signedOurs}; theirs -> ours: ${signedTheirs}, as many refused of another key`);
  console.log(`all-zero payloads they sent with length 0 (known difference): ${emptyPayloads}`);
  console.log(failures === 0 ? "every byte and every field agrees" : `${failures} differences`);
  process.exit(failures === 0 ? 0 : 1);
})().catch((error) => {
  console.error(error);
  process.exit(1);
});
