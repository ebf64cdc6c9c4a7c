#!/usr/bin/env python3
"""Writes the C++ message structs from a MAVLink definition file: generate.py wasp.xml mavlink_messages.h

Base fields are sorted by element size, largest first, equal sizes in file order; extensions follow unsorted. CRC_EXTRA
is computed over the message name and the base fields in wire order. Any inconsistency in the file ends the build.
"""
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

SIZES = {"uint64_t": 8, "int64_t": 8, "double": 8, "uint32_t": 4, "int32_t": 4, "float": 4,
         "uint16_t": 2, "int16_t": 2, "uint8_t": 1, "int8_t": 1, "char": 1}
MAX_PAYLOAD = 255


@dataclass
class Field:
    name: str
    type: str       # element type
    length: int     # 0: not an array
    extension: bool
    doc: str
    offset: int = 0

    @property
    def bytes(self):
        return SIZES[self.type] * max(1, self.length)

    @property
    def cpp_type(self):
        element = self.type if self.type in ("float", "double", "char") else f"std::{self.type}"
        return f"std::array<{element}, {self.length}>" if self.length else element


@dataclass
class Message:
    id: int
    name: str
    doc: str
    fields: list    # in wire order
    crc_extra: int = 0

    @property
    def min_length(self):
        return sum(f.bytes for f in self.fields if not f.extension)

    @property
    def max_length(self):
        return sum(f.bytes for f in self.fields)

    @property
    def cpp_name(self):
        return camel(self.name)


def fail(text):
    sys.exit(f"generate.py: {text}")


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


def text_of(node):
    return " ".join((node.text or "").split()) if node is not None else ""


def crc_mcrf4xx(data, crc=0xFFFF):
    """CRC-16/MCRF4XX: polynomial 0x1021 reflected, initial 0xFFFF, no final XOR."""
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def crc_extra(message):
    crc = crc_mcrf4xx(f"{message.name} ".encode())
    for field in message.fields:
        if field.extension:
            continue
        crc = crc_mcrf4xx(f"{field.type} {field.name} ".encode(), crc)
        if field.length:
            crc = crc_mcrf4xx(bytes([field.length]), crc)
    return (crc & 0xFF) ^ (crc >> 8)


def read_field(node, extension, message):
    element, _, rest = node.get("type").partition("[")
    element = element.removesuffix("_mavlink_version")
    if element not in SIZES:
        fail(f"{message}.{node.get('name')}: unknown type {element}")
    doc = text_of(node)
    if node.get("units"):
        doc = f"[{node.get('units')}] {doc}"
    if node.get("invalid"):
        doc += f" Not known: {node.get('invalid')}."
    return Field(node.get("name"), element, int(rest.rstrip("]")) if rest else 0, extension, doc)


def read_message(node):
    name = node.get("name")
    base, extensions = [], []
    target = base
    for child in node:
        if child.tag == "extensions":
            target = extensions
        elif child.tag == "field":
            target.append(read_field(child, target is extensions, name))
    fields = sorted(base, key=lambda f: -SIZES[f.type]) + extensions
    offset = 0
    for field in fields:
        field.offset = offset
        offset += field.bytes
    message = Message(int(node.get("id")), name, text_of(node.find("description")), fields)
    if len({f.name for f in fields}) != len(fields):
        fail(f"{name}: a field name occurs twice")
    if not 0 < message.max_length <= MAX_PAYLOAD:
        fail(f"{name}: payload of {message.max_length} bytes")
    message.crc_extra = crc_extra(message)
    return message


def read_messages(root):
    messages = sorted((read_message(node) for node in root.iter("message")), key=lambda m: m.id)
    for what in ("id", "name"):
        values = [getattr(m, what) for m in messages]
        if len(set(values)) != len(values):
            fail(f"a message {what} occurs twice")
    return messages


def write_enum(node, out):
    name, entries = node.get("name"), node.findall("entry")
    values = [int(entry.get("value")) for entry in entries]
    bits = next(b for b in (8, 16, 32, 64) if max(values) < 1 << b)
    out.append(f"/// {text_of(node.find('description'))}")
    out.append(f"namespace {name.lower()} {{")
    for entry, value in zip(entries, values):
        full = entry.get("name")
        short = full.removeprefix(name + "_") if full.startswith(name + "_") else full.removeprefix("MAV_")
        doc = text_of(entry.find("description"))
        params = ", ".join(f"p{p.get('index')} {text_of(p)}" for p in entry.findall("param"))
        doc = " ".join(part for part in (doc, f"({params})" if params else "") if part)
        out.append(f"inline constexpr std::uint{bits}_t k{camel(short)} = {value};" + (f"  ///< {doc}" if doc else ""))
    out.append(f"}}  // namespace {name.lower()}\n")


def write_message(m, out):
    out.append(f"/// {m.name} ({m.id}). {m.doc}")
    out.append(f"struct {m.cpp_name} {{")
    out.append(f"  static constexpr std::uint32_t kId = {m.id};")
    out.append(f"  static constexpr std::uint8_t kCrcExtra = {m.crc_extra};")
    out.append(f"  static constexpr std::size_t kMinLength = {m.min_length};")
    out.append(f"  static constexpr std::size_t kMaxLength = {m.max_length};")
    out.append(f'  static constexpr const char* kName = "{m.name}";\n')
    out.extend(f"  {f.cpp_type} {f.name}{{}};  ///< {f.doc}" for f in m.fields)
    out.append("\n  /// Writes kMaxLength bytes. Realtime-safe: yes.")
    out.append("  void pack(std::uint8_t* payload) const noexcept {")
    out.extend(f"    wire::put(payload + {f.offset}, {f.name});" for f in m.fields)
    out.append("  }\n  /// A short payload reads as zero beyond its end, surplus is ignored. Realtime-safe: yes.")
    out.append(f"  static {m.cpp_name} unpack(const std::uint8_t* payload, std::size_t length) noexcept {{")
    out.append("    const auto full = wire::full_length<kMaxLength>(payload, length);")
    out.append(f"    {m.cpp_name} message;")
    out.extend(f"    wire::get(full.data() + {f.offset}, message.{f.name});" for f in m.fields)
    out.append("    return message;\n  }")
    out.append("  /// Calls visit(name, offset in the payload, field, is an extension) for each field in wire order.")
    out.append("  template <class Self, class Visit>\n  static void for_each_field(Self& self, Visit&& visit) {")
    out.extend(f'    visit("{f.name}", std::size_t{{{f.offset}}}, self.{f.name}, {str(f.extension).lower()});'
               for f in m.fields)
    out.append("  }\n};\n")


def write_table(messages, out):
    out.append("/// Every message, rising in id.")
    out.append(f"inline constexpr std::array<MessageInfo, {len(messages)}> kMessages = {{{{")
    out.extend(f'    {{{m.id}, "{m.name}", {m.crc_extra}, {m.min_length}, {m.max_length}}},' for m in messages)
    out.append("}};\n")
    out.append("/// Calls visit.template operator()<Message>() for every message type, rising in id.")
    out.append("template <class Visit>\nvoid for_each_message(Visit&& visit) {")
    out.extend(f"  visit.template operator()<{m.cpp_name}>();" for m in messages)
    out.append("}\n")


def main():
    if len(sys.argv) != 3:
        fail("usage: generate.py definitions.xml header.h")
    root = ElementTree.parse(sys.argv[1]).getroot()
    messages = read_messages(root)
    out = ["// MAVLink messages as structs. Written by messages/generate.py from messages/wasp.xml; not to be edited.",
           "#pragma once\n", "#include <array>\n#include <cstddef>\n#include <cstdint>\n",
           '#include "messages/message_info.h"\n', "namespace wasp::mavlink {\n"]
    for node in root.iter("enum"):
        write_enum(node, out)
    for message in messages:
        write_message(message, out)
    write_table(messages, out)
    out.append("}  // namespace wasp::mavlink\n")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write("\n".join(out))


if __name__ == "__main__":
    main()
