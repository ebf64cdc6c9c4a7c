#!/usr/bin/env python3
"""Writes the C++ message structs and the JSON description from a MAVLink definition file:

    generate.py wasp.xml [--header mavlink_messages.h] [--json mavlink_messages.json] [--table-only telemetry.xml]

Messages of a --table-only file have a row in the message table (so that frames are verified) and a place in the JSON
(so that they are decoded), but no struct. A definition that cannot be used ends the build with a line that says why.
"""
import argparse
import json
import os
import sys

from definition import Invalid, read_definition

KEYWORDS = set("""alignas alignof and asm auto bool break case catch char class concept const continue default delete do double
else enum explicit export extern false float for friend goto if inline int long mutable namespace new noexcept not nullptr
operator or private protected public register requires return short signed sizeof static struct switch template this throw true
try typedef typename union unsigned using virtual void volatile while xor""".split())
EXACT_IN_JSON = 2**53


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


def member(name):
    return name + "_" if name in KEYWORDS else name


def cpp_type(f):
    element = f.type if f.type in ("float", "double", "char") else f"std::{f.type}"
    return f"std::array<{element}, {f.length}>" if f.length else element


def field_doc(f):
    doc = f"[{f.units}] {f.doc}" if f.units else f.doc
    return f"{doc} Not known: {f.invalid}." if f.invalid else doc


def short_names(enum):
    """Entry names without what they share; whole where that would make two of them one."""
    def shortened(name):
        return name.removeprefix(enum.name + "_") if name.startswith(enum.name + "_") else name.removeprefix("MAV_")
    names = [camel(shortened(e.name)) for e in enum.entries]
    return names if len(set(names)) == len(names) else [e.name for e in enum.entries]


def write_enum(enum, out):
    if not enum.entries:
        return
    values = [e.value for e in enum.entries]
    signed = min(values) < 0
    bits = next(b for b in (8, 16, 32, 64) if max(values) < 1 << (b - signed) and min(values) >= -(1 << (b - 1)))
    out.append(f"/// {enum.doc}")
    out.append(f"namespace {member(enum.name.lower())} {{")
    for entry, short in zip(enum.entries, short_names(enum)):
        params = ", ".join(f"p{index} {text}" for index, text in entry.params)
        doc = " ".join(part for part in (entry.doc, f"({params})" if params else "") if part)
        suffix = "u" if entry.value >= 1 << 63 else ""
        out.append(f"inline constexpr std::{'' if signed else 'u'}int{bits}_t k{short} = {entry.value}{suffix};" +
                   (f"  ///< {doc}" if doc else ""))
    out.append(f"}}  // namespace {enum.name.lower()}\n")


def write_struct(m, out):
    name = camel(m.name)
    out.append(f"/// {m.name} ({m.id}). {m.doc}")
    out.append(f"struct {name} {{")
    out.append(f"  static constexpr std::uint32_t kId = {m.id};")
    out.append(f"  static constexpr std::uint8_t kCrcExtra = {m.crc_extra};")
    out.append(f"  static constexpr std::size_t kMinLength = {m.min_length};")
    out.append(f"  static constexpr std::size_t kMaxLength = {m.max_length};")
    out.append(f'  static constexpr const char* kName = "{m.name}";\n')
    out.extend(f"  {cpp_type(f)} {member(f.name)}{{}};  ///< {field_doc(f)}" for f in m.fields)
    out.append("\n  /// Writes kMaxLength bytes. Realtime-safe: yes.")
    out.append("  void pack(std::uint8_t* payload) const noexcept {")
    out.extend(f"    wire::put(payload + {f.offset}, {member(f.name)});" for f in m.fields)
    out.append("  }\n  /// A short payload reads as zero beyond its end, surplus is ignored. Realtime-safe: yes.")
    out.append(f"  static {name} unpack(const std::uint8_t* payload, std::size_t length) noexcept {{")
    out.append("    const auto full = wire::full_length<kMaxLength>(payload, length);")
    out.append(f"    {name} message;")
    out.extend(f"    wire::get(full.data() + {f.offset}, message.{member(f.name)});" for f in m.fields)
    out.append("    return message;\n  }")
    out.append("  /// Calls visit(name, offset in the payload, field, is an extension) for each field in wire order.")
    out.append("  template <class Self, class Visit>\n  static void for_each_field(Self& self, Visit&& visit) {")
    out.extend(f'    visit("{f.name}", std::size_t{{{f.offset}}}, self.{member(f.name)}, {str(f.extension).lower()});'
               for f in m.fields)
    out.append("  }\n};\n")


def write_table(messages, structs, out):
    out.append("/// Every message, rising in id.")
    out.append(f"inline constexpr std::array<MessageInfo, {len(messages)}> kMessages = {{{{")
    out.extend(f'    {{{m.id}, "{m.name}", {m.crc_extra}, {m.min_length}, {m.max_length}}},' for m in messages)
    out.append("}};\n")
    out.append("/// Calls visit.template operator()<Message>() for every message that has a struct, rising in id.")
    out.append("template <class Visit>\nvoid for_each_message(Visit&& visit) {")
    out.extend(f"  visit.template operator()<{camel(m.name)}>();" for m in structs)
    out.append("}\n")


def header_text(definition, table_only):
    structs = [m for m in definition.messages if os.path.basename(m.file) not in table_only]
    out = ["// MAVLink messages as structs. Written by messages/generate.py from messages/*.xml; not to be edited.",
           "#pragma once\n", "#include <array>\n#include <cstddef>\n#include <cstdint>\n",
           '#include "messages/message_info.h"\n', "namespace wasp::mavlink {\n"]
    for enum in definition.enums.values():
        write_enum(enum, out)
    for message in structs:
        write_struct(message, out)
    write_table(definition.messages, structs, out)
    out.append("}  // namespace wasp::mavlink\n")
    return "\n".join(out)


def without_blanks(**values):
    return {key: value for key, value in values.items() if value not in ("", False)}


def json_number(value):
    return value if abs(value) <= EXACT_IN_JSON else str(value)


def json_text(definition):
    """All a decoder needs: offsets in the payload, little-endian without padding; array_length 0 is not an array."""
    messages = [{"id": m.id, "name": m.name, "crc_extra": m.crc_extra, "min_length": m.min_length,
                 "max_length": m.max_length, **without_blanks(description=m.doc),
                 "fields": [{"name": f.name, "type": f.type, "offset": f.offset, "array_length": f.length,
                             "extension": f.extension,
                             **without_blanks(units=f.units, enum=f.enum, invalid=f.invalid, display=f.display,
                                              instance=f.instance, description=f.doc)} for f in m.fields]}
                for m in definition.messages]
    enums = {e.name: {"bitmask": e.bitmask, **without_blanks(description=e.doc),
                      "entries": [{"name": x.name, "value": json_number(x.value), **without_blanks(description=x.doc),
                                   **({"params": {i: t for i, t in x.params}} if x.params else {})} for x in e.entries]}
             for e in definition.enums.values()}
    return json.dumps({"format": "wasp MAVLink description", "format_version": 1, "byte_order": "little",
                       "messages": messages, "enums": enums}, indent=1, ensure_ascii=False) + "\n"


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    arguments = argparse.ArgumentParser(description="MAVLink definition to C++ structs and JSON description")
    arguments.add_argument("definition")
    arguments.add_argument("--header")
    arguments.add_argument("--json")
    arguments.add_argument("--table-only", action="append", default=[])
    options = arguments.parse_args()
    try:
        definition = read_definition(options.definition)
    except Invalid as error:
        sys.exit(f"generate.py: {error}")
    if options.header:
        write(options.header, header_text(definition, options.table_only))
    if options.json:
        write(options.json, json_text(definition))


if __name__ == "__main__":
    main()
