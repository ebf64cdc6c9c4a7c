// Decodes the published vectors from the JSON description alone, as a ground station would: layout, CRC_EXTRA, units and
// enumerations come from the file, nothing from a MAVLink library.
// usage: node description.cjs mavlink_messages.json
const fs = require("fs");
const description = JSON.parse(fs.readFileSync(process.argv[2], "utf8"));
const byId = new Map(description.messages.map((message) => [message.id, message]));

let failures = 0;
function expect(condition, text) {
  if (condition) return;
  ++failures;
  console.error("FAIL " + text);
}

function crc(bytes) {
  let value = 0xffff;
  for (const byte of bytes) {
    value ^= byte;
    for (let bit = 0; bit < 8; ++bit) value = value & 1 ? (value >>> 1) ^ 0x8408 : value >>> 1;
  }
  return value;
}

const READ = {
  uint8_t: ["readUInt8", 1], int8_t: ["readInt8", 1], char: ["readUInt8", 1], uint16_t: ["readUInt16LE", 2], int16_t: ["readInt16LE", 2],
  uint32_t: ["readUInt32LE", 4], int32_t: ["readInt32LE", 4], float: ["readFloatLE", 4], double: ["readDoubleLE", 8],
  uint64_t: ["readBigUInt64LE", 8], int64_t: ["readBigInt64LE", 8],
};

/** Fields of a version 2 frame by name; throws when its checksum does not hold. */
function decode(frame) {
  const id = frame.readUIntLE(7, 3), message = byId.get(id), end = 10 + frame[1];
  if (!message) throw new Error(`id ${id} is not described`);
  const covered = Buffer.concat([frame.subarray(1, end), Buffer.from([message.crc_extra])]);
  if (crc(covered) !== frame.readUInt16LE(end)) throw new Error(`${message.name}: checksum`);
  const payload = Buffer.concat([frame.subarray(10, end), Buffer.alloc(255)]);
  const fields = {};
  for (const field of message.fields) {
    const [read, size] = READ[field.type];
    if (field.type === "char" && field.array_length > 0) {
      const text = payload.subarray(field.offset, field.offset + field.array_length).toString("latin1");
      fields[field.name] = text.split("\0")[0];
    } else if (field.array_length > 0) {
      fields[field.name] = Array.from({ length: field.array_length }, (_, i) => payload[read](field.offset + i * size));
    } else {
      fields[field.name] = payload[read](field.offset);
    }
  }
  return { message, fields };
}

function enumValue(name, entry) {
  return description.enums[name].entries.find((e) => e.name === entry).value;
}

const f = Math.fround;
const heartbeat = { type: enumValue("MAV_TYPE", "MAV_TYPE_ONBOARD_CONTROLLER"), autopilot: enumValue("MAV_AUTOPILOT", "MAV_AUTOPILOT_INVALID"),
  base_mode: 0, custom_mode: 0, system_status: enumValue("MAV_STATE", "MAV_STATE_ACTIVE"), mavlink_version: 3 };
const VECTORS = [
  ["HEARTBEAT", heartbeat, "fd0900000001bf000000000000001208000403aec6"],
  ["SET_ATTITUDE_TARGET", { time_boot_ms: 1234, target_system: 1, target_component: 1, type_mask: 7, q: [1, 0, 0, 0], thrust: 0.5 },
    "fd2700000501bf520000d20400000000803f0000000000000000000000000000000000000000000000000000003f0101075805"],
  ["TIMESYNC", { tc1: 0n, ts1: 123456789n }, "fd0c00000101bf6f0000000000000000000015cd5b0759c7"],
  ["STATUSTEXT", { severity: 6, text: "wasp ready" }, "fd0b00000201bffd00000677617370207265616479c3db"],
  ["PING", { time_usec: 0n, seq: 0, target_system: 0 }, "fd0100000301bf04000000bf5e"],
  ["OPTICAL_FLOW_RAD", { time_usec: 1000000n, integration_time_us: 50000, integrated_x: f(0.01), integrated_y: f(-0.02), integrated_xgyro: f(0.003),
    integrated_ygyro: f(-0.004), integrated_zgyro: f(0.005), temperature: 0, quality: 200, distance: 1.5 },
    "fd2c00000401bf6a000040420f000000000050c300000ad7233c0ad7a3bca69b443b6f1283bb0ad7a33b000000000000c03f000000c848ba"],
  ["ATTITUDE_QUATERNION", { time_boot_ms: 1000, q1: 0.5, q2: 0.5, q3: -0.5, q4: 0.5, rollspeed: f(0.1), pitchspeed: f(0.2), yawspeed: f(-0.3) },
    "fd2000000601bf1f0000e80300000000003f0000003f000000bf0000003fcdcccc3dcdcc4c3e9a9999be444b"],
  ["HIGHRES_IMU", { time_usec: 2000000n, xacc: 0.25, yacc: -0.5, zacc: -9.75, xgyro: 0.125, zgyro: -0.125, xmag: 0.5, ymag: 0.25, abs_pressure: 1013.25,
    pressure_alt: 100.5, temperature: 25, fields_updated: 0x3f, id: 0 },
    "fd3d00000701bf69000080841e00000000000000803e000000bf00001cc10000003e00000000000000be0000003f0000803e0000000000507d44000000000000c9420000c8413f253f"],
  ["OBSTACLE_DISTANCE", { time_usec: 3000000n, sensor_type: 4, distances: [100, 200, ...Array(70).fill(65535)], increment: 5, min_distance: 20,
    max_distance: 1000, increment_f: 2.5, angle_offset: -90, frame: 12 },
    "fda700000801bf4a0100c0c62d00000000006400c800" + "f".repeat(280) + "1400e8030405000020400000b4c20c59de"],
  ["COMMAND_LONG", { target_system: 1, target_component: 1, command: 400, param1: 1, param7: 0 },
    "fd2000000a01bf4c00000000803f000000000000000000000000000000000000000000000000900101010a83"],
  ["COMMAND_ACK", { command: 400, result: 0 }, "fd0200000b01bf4d000090011b27"],
  ["PARAM_VALUE", { param_id: "WASP_RATE_HZ", param_value: 20, param_type: 9, param_count: 3, param_index: 1 },
    "fd1900000c01bf1600000000a04103000100574153505f524154455f485a00000000095318"],
  ["NAMED_VALUE_FLOAT", { time_boot_ms: 5000, name: "tau", value: 1.5 }, "fd0b00000d01bffb0000881300000000c03f7461755c12"],
  ["DEBUG_VECT", { name: "foe", time_usec: 6000000n, x: 1, y: -1, z: 0.5 }, "fd1700000e01bffa0000808d5b00000000000000803f000080bf0000003f666f65b17c"],
  ["HIL_ACTUATOR_CONTROLS", { time_usec: 7000000n, controls: [0.5, 0.5, 0.5, 0.5, ...Array(12).fill(0)], mode: 129, flags: 1n },
    "fd5100000f01bf5d0000c0cf6a000000000001000000000000000000003f0000003f0000003f0000003f" + "0".repeat(96) + "8192b9"],
  ["DISTANCE_SENSOR", { time_boot_ms: 8000, min_distance: 10, max_distance: 500, current_distance: 123, type: 4, id: 0, orientation: 25, covariance: 255 },
    "fd0e00001001bf840000401f00000a00f4017b00040019ff2e50"],
  ["HEARTBEAT", heartbeat, "fd0901000901bf0000000000000012080004039de0036655443322115145f78df360"],
];

for (const [name, want, hex] of VECTORS) {
  const { message, fields } = decode(Buffer.from(hex, "hex"));
  expect(message.name === name, `${message.name} for ${name}`);
  for (const [field, value] of Object.entries(want)) {
    const same = Array.isArray(value) ? value.every((x, i) => Object.is(x, fields[field][i])) : Object.is(value, fields[field]);
    expect(same, `${name}.${field}: ${fields[field]} for ${value}`);
  }
}
for (const name of ["WASP_CUE", "WASP_LATENCY", "WASP_FLOW", "WASP_STATE"])
  expect(description.messages.some((message) => message.name === name), `${name} is described`);
console.log(`${VECTORS.length} vectors decoded from the description of ${description.messages.length} messages alone, ${failures} failures`);
process.exit(failures === 0 ? 0 : 1);
