"""Reads a MAVLink definition file with all it includes (MAVLink guide, "XML schema").

Base fields are sorted by element size, largest first, equal sizes in file order; extensions follow unsorted. CRC_EXTRA
is computed over the message name and the base fields in wire order. Whatever a file gets wrong is an Invalid with the
name of the file and of what is wrong in it.
"""
import os
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field

SIZES = {"uint64_t": 8, "int64_t": 8, "double": 8, "uint32_t": 4, "int32_t": 4, "float": 4,
         "uint16_t": 2, "int16_t": 2, "uint8_t": 1, "int8_t": 1, "char": 1}
MAX_PAYLOAD, MAX_ID, MAX_INCLUDES = 255, 0xFFFFFF, 64
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


class Invalid(Exception):
    """A definition that cannot be used; the text says where and why."""


@dataclass
class Field:
    name: str
    type: str       # element type
    length: int     # 0: not an array
    extension: bool
    doc: str
    units: str = ""
    enum: str = ""
    invalid: str = ""   # the value that stands for "not known"
    display: str = ""
    instance: bool = False
    offset: int = 0

    @property
    def bytes(self):
        return SIZES[self.type] * max(1, self.length)


@dataclass
class Message:
    id: int
    name: str
    doc: str
    fields: list    # in wire order
    file: str
    crc_extra: int = 0

    @property
    def min_length(self):
        return sum(f.bytes for f in self.fields if not f.extension)

    @property
    def max_length(self):
        return sum(f.bytes for f in self.fields)

    @property
    def layout(self):
        return self.id, self.name, [(f.name, f.type, f.length, f.extension) for f in self.fields]


@dataclass
class Entry:
    name: str
    value: int
    doc: str
    params: list    # pairs of index and text


@dataclass
class Enum:
    name: str
    doc: str
    bitmask: bool
    entries: list = field(default_factory=list)


@dataclass
class Definition:
    messages: list  # rising in id
    enums: dict     # by name, in order of appearance


def text_of(node):
    return " ".join("".join(node.itertext()).split()) if node is not None else ""


def crc_mcrf4xx(data, crc=0xFFFF):
    """CRC-16/MCRF4XX: polynomial 0x1021 reflected, initial 0xFFFF, no final XOR."""
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def crc_extra(message):
    crc = crc_mcrf4xx(f"{message.name} ".encode())
    for f in message.fields:
        if f.extension:
            continue
        crc = crc_mcrf4xx(f"{f.type} {f.name} ".encode(), crc)
        if f.length:
            crc = crc_mcrf4xx(bytes([f.length]), crc)
    return (crc & 0xFF) ^ (crc >> 8)


def number(text, what):
    """Decimal, 0x..., 0b... or a power as 2**3."""
    try:
        base, power, exponent = (text or "").strip().partition("**")
        return int(base, 0) ** int(exponent, 0) if power else int(base, 0)
    except ValueError:
        raise Invalid(f"{what}: '{text}' is not a number") from None


def name_of(node, what):
    name = node.get("name") or ""
    if not NAME.match(name):
        raise Invalid(f"{what}: '{name}' is not a name")
    return name


def read_field(node, extension, where):
    name = name_of(node, f"{where}, field")
    match = re.fullmatch(r"\s*(\w+?)(_mavlink_version)?\s*(?:\[\s*(\d+)\s*\])?\s*", node.get("type") or "")
    if match is None or match.group(1) not in SIZES:
        raise Invalid(f"{where}.{name}: unknown type '{node.get('type')}'")
    length = int(match.group(3) or 0)
    if match.group(3) is not None and not 0 < length <= MAX_PAYLOAD:
        raise Invalid(f"{where}.{name}: an array of {length}")
    attribute = lambda key: (node.get(key) or "").strip()
    return Field(name, match.group(1), length, extension, text_of(node), attribute("units").strip("[]"), attribute("enum"),
                 attribute("invalid"), attribute("display") or attribute("print_format"), attribute("instance") == "true")


def read_message(node, file):
    where = f"{file}: message {node.get('name') or node.get('id')}"
    name = name_of(node, where)
    base, extensions = [], []
    target = base
    for child in node:
        if child.tag == "extensions":
            target = extensions
        elif child.tag == "field":
            target.append(read_field(child, target is extensions, where))
    fields = sorted(base, key=lambda f: -SIZES[f.type]) + extensions
    offset = 0
    for f in fields:
        f.offset = offset
        offset += f.bytes
    message = Message(number(node.get("id"), f"{where}, id"), name, text_of(node.find("description")), fields, file)
    if not 0 <= message.id <= MAX_ID:
        raise Invalid(f"{where}: id {message.id} does not fit 24 bits")
    if len({f.name for f in fields}) != len(fields):
        raise Invalid(f"{where}: a field name occurs twice")
    if not base or message.max_length > MAX_PAYLOAD:
        raise Invalid(f"{where}: payload of {message.max_length} bytes, {len(base)} base fields")
    message.crc_extra = crc_extra(message)
    return message


def read_enum(node, file, enums):
    """Enums of one name in several files are one; an entry without a value follows the one before it."""
    where = f"{file}: enum {node.get('name')}"
    enum = enums.setdefault(name_of(node, where), Enum(node.get("name"), "", False))
    enum.doc = enum.doc or text_of(node.find("description"))
    enum.bitmask = enum.bitmask or node.get("bitmask") == "true"
    for child in node.findall("entry"):
        name = name_of(child, f"{where}, entry")
        follows = enum.entries[-1].value + 1 if enum.entries else 0
        value = follows if child.get("value") is None else number(child.get("value"), f"{where}.{name}")
        if not -2**31 <= value < 2**64:
            raise Invalid(f"{where}.{name}: {value} is out of range")
        params = [(p.get("index"), text_of(p)) for p in child.findall("param") if text_of(p)]
        known = next((e for e in enum.entries if e.name == name), None)
        if known is None:
            enum.entries.append(Entry(name, value, text_of(child.find("description")), params))
        elif known.value != value:
            raise Invalid(f"{where}.{name}: is {known.value} elsewhere and {value} here")


def root_of(path, included_by):
    try:
        root = ElementTree.parse(path).getroot()
    except OSError as error:
        by = f", included by {included_by}" if included_by else ""
        raise Invalid(f"{path}{by}: {error.strerror}") from None
    except ElementTree.ParseError as error:
        raise Invalid(f"{path}: not XML: {error}") from None
    if root.tag != "mavlink":
        raise Invalid(f"{path}: the root is <{root.tag}>, not <mavlink>")
    return root


def files_of(path, included_by="", seen=None):
    """Pairs of path and root, included files before those that include them, each once."""
    seen = {} if seen is None else seen
    real = os.path.realpath(path)
    if real in seen:
        return []
    seen[real] = True
    if len(seen) > MAX_INCLUDES:
        raise Invalid(f"{path}: more than {MAX_INCLUDES} files")
    root = root_of(path, included_by)
    files = []
    for include in root.findall("include"):
        files += files_of(os.path.join(os.path.dirname(path), (include.text or "").strip()), path, seen)
    return files + [(path, root)]


def read_definition(path):
    by_id, by_name, enums = {}, {}, {}
    for file, root in files_of(path):
        for node in root.iterfind("enums/enum"):
            read_enum(node, file, enums)
        for node in root.iterfind("messages/message"):
            message = read_message(node, file)
            for table, key in ((by_id, message.id), (by_name, message.name)):
                other = table.setdefault(key, message)
                if other.layout != message.layout:
                    raise Invalid(f"{file}: message {message.name} ({message.id}) is another one, {other.name} "
                                  f"({other.id}), in {other.file}")
    if not by_id:
        raise Invalid(f"{path}: no messages")
    return Definition([by_id[i] for i in sorted(by_id)], enums)
