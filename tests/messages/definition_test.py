#!/usr/bin/env python3
"""messages/generate.py on a dialect of somebody else, and on definitions that cannot be used."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

GENERATE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "messages", "generate.py")

BASE = """<?xml version="1.0"?>
<mavlink>
  <version>3</version>
  <enums>
    <enum name="KIND"><description>Kinds.</description>
      <entry value="1" name="KIND_ONE"/>
      <entry value="0x10" name="KIND_HEX"/>
      <entry value="2**5" name="KIND_POWER"/>
      <entry name="KIND_NEXT"><deprecated since="2020-01" replaced_by="KIND_ONE">gone</deprecated></entry>
    </enum>
  </enums>
  <messages>
    <message id="0" name="HEARTBEAT">
      <description>Beat.</description>
      <field type="uint8_t" name="type" enum="MAV_TYPE">a</field>
      <field type="uint8_t" name="autopilot">b</field>
      <field type="uint8_t" name="base_mode" display="bitmask">c</field>
      <field type="uint32_t" name="custom_mode">d</field>
      <field type="uint8_t" name="system_status">e</field>
      <field type="uint8_t_mavlink_version" name="mavlink_version">f</field>
    </message>
  </messages>
</mavlink>
"""
DIALECT = """<?xml version="1.0"?>
<mavlink>
  <include>base.xml</include>
  <dialect>7</dialect>
  <enums>
    <enum name="KIND"><entry value="64" name="KIND_MORE"><param index="1" label="x" units="m">one</param></entry></enum>
    <enum name="SIGNED_KIND"><entry value="-1" name="SIGNED_KIND_NONE"/></enum>
  </enums>
  <messages>
    <message id="77000" name="MIXED"><wip/>
      <description>Order on the wire is by size.</description>
      <field type="uint8_t" name="class" instance="true">a C++ word</field>
      <field type="int16_t[3]" name="three" units="cm" invalid="[INT16_MAX]" print_format="0x%04x">text <b>with</b> tags</field>
      <field type="double" name="wide">w</field>
      <field type="char[5]" name="text">t</field>
      <extensions/>
      <field type="uint64_t" name="late">l</field>
    </message>
  </messages>
</mavlink>
"""


class Definition(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def generate(self, name, *more):
        return subprocess.run([sys.executable, "-B", GENERATE, self.path(name), "--json", self.path("out.json"), "--header",
                               self.path("out.h"), *more], capture_output=True, text=True, check=False)

    def description(self):
        with open(self.path("out.json"), encoding="utf-8") as file:
            return json.load(file)

    def refusal(self, text, name="bad.xml"):
        self.write(name, text)
        done = self.generate(name)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        return done.stderr

    def test_reads_the_dialect_of_somebody_else(self):
        self.write("base.xml", BASE)
        self.write("dialect.xml", DIALECT)
        done = self.generate("dialect.xml")
        self.assertEqual(done.returncode, 0, done.stderr)
        d = self.description()
        self.assertEqual([(m["id"], m["name"]) for m in d["messages"]], [(0, "HEARTBEAT"), (77000, "MIXED")])
        self.assertEqual(d["messages"][0]["crc_extra"], 50)
        mixed = d["messages"][1]
        self.assertEqual([(f["name"], f["type"], f["offset"], f["array_length"], f["extension"]) for f in mixed["fields"]],
                         [("wide", "double", 0, 0, False), ("three", "int16_t", 8, 3, False),
                          ("class", "uint8_t", 14, 0, False), ("text", "char", 15, 5, False),
                          ("late", "uint64_t", 20, 0, True)])
        self.assertEqual((mixed["min_length"], mixed["max_length"]), (20, 28))
        three = mixed["fields"][1]
        self.assertEqual((three["units"], three["invalid"], three["display"]), ("cm", "[INT16_MAX]", "0x%04x"))
        self.assertTrue(mixed["fields"][2]["instance"])
        kinds = {e["name"]: e["value"] for e in d["enums"]["KIND"]["entries"]}
        self.assertEqual(kinds, {"KIND_ONE": 1, "KIND_HEX": 16, "KIND_POWER": 32, "KIND_NEXT": 33, "KIND_MORE": 64})

    def test_its_header_compiles(self):
        self.write("base.xml", BASE)
        self.write("dialect.xml", DIALECT)
        self.assertEqual(self.generate("dialect.xml", "--table-only", "base.xml").returncode, 0)
        compiler = os.environ.get("CXX", "c++")
        house = os.path.join(os.path.dirname(GENERATE), "..")
        done = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", "-x", "c++", "-I", house, self.path("out.h")],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("out.h"), encoding="utf-8") as file:
            text = file.read()
        self.assertIn("struct Mixed", text)
        self.assertNotIn("struct Heartbeat", text)
        self.assertIn('{0, "HEARTBEAT", 50, 9, 9}', text)

    def test_includes_in_a_circle_are_read_once(self):
        self.write("base.xml", BASE.replace("<version>", "<include>dialect.xml</include><version>"))
        self.write("dialect.xml", DIALECT)
        self.assertEqual(self.generate("dialect.xml").returncode, 0)

    def test_says_what_is_wrong_and_where(self):
        message = '<mavlink><messages><message id="%s" name="%s">%s</message></messages></mavlink>'
        field = '<field type="uint8_t" name="a"/>'
        self.assertIn("not XML", self.refusal("<mavlink>"))
        self.assertIn("root is <html>", self.refusal("<html/>"))
        self.assertIn("absent.xml, included by", self.refusal("<mavlink><include>absent.xml</include></mavlink>"))
        self.assertIn("no messages", self.refusal("<mavlink/>"))
        self.assertIn("unknown type 'uint24_t'", self.refusal(message % (1, "A", '<field type="uint24_t" name="a"/>')))
        self.assertIn("unknown type 'None'", self.refusal(message % (1, "A", '<field name="a"/>')))
        self.assertIn("an array of 0", self.refusal(message % (1, "A", '<field type="char[0]" name="a"/>')))
        self.assertIn("'x' is not a number", self.refusal(message % ("x", "A", field)))
        self.assertIn("does not fit 24 bits", self.refusal(message % (2**24, "A", field)))
        self.assertIn("is not a name", self.refusal(message % (1, "A B", field)))
        self.assertIn("occurs twice", self.refusal(message % (1, "A", field + field)))
        self.assertIn("payload of 400 bytes", self.refusal(message % (1, "A", '<field type="double[50]" name="a"/>')))
        self.assertIn("is another one", self.refusal(
            '<mavlink><messages><message id="1" name="A">' + field + '</message><message id="1" name="B">' + field +
            "</message></messages></mavlink>"))
        self.assertIn("is 1 elsewhere and 2 here", self.refusal(
            '<mavlink><enums><enum name="E"><entry name="E_A" value="1"/></enum><enum name="E"><entry name="E_A" value="2"/>'
            "</enum></enums></mavlink>"))


if __name__ == "__main__":
    unittest.main()
