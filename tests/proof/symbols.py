#!/usr/bin/env python3
"""What the vision and control archives call outside themselves, held against a written list (symbols.txt).

An import must be named in the list. An import of the kind "start-up" (allocator, exceptions, FFTW's planner) may be
reached, directly or through other functions of the archives, only from functions the list names as start-up functions:
so no step function can get there. A line of the list that fits nothing any more is an error too. The calls are read from
the disassembly of a program that links the whole archives; calls through function pointers are not followed, but what
they lead to is in the archives and judged like everything else.
"""
import argparse
import collections
import re
import subprocess
import sys


def output(*command, text=None):
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


class Entry:
    """One line `kind pattern: reason`; in a pattern * is anything, and Class::Class a constructor."""

    KINDS = ("import", "start-up-import", "start-up")

    def __init__(self, path, number, line):
        self.where = f"{path}:{number}"
        found = re.fullmatch(r"(\S+) +(.+?): +(\S.*)", line)
        if found is None or found[1] not in self.KINDS:
            sys.exit(f"{self.where}: expected '<{'|'.join(self.KINDS)}> <pattern>: <reason>'")
        self.kind, self.pattern = found[1], found[2]
        regex = ".*".join(re.escape(part) for part in self.pattern.split("*"))
        self.regex = re.compile(regex.replace("Class::Class", r"(\w+)::\1"))
        self.used = False


class List:
    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            lines = [(n, line.strip()) for n, line in enumerate(file, 1)]
        self.entries = [Entry(path, n, line) for n, line in lines if line and not line.startswith("#")]

    def fits(self, kind, name):
        fitting = [e for e in self.entries if e.kind == kind and e.regex.fullmatch(name)]
        for entry in fitting:
            entry.used = True
        return bool(fitting)

    def stale(self):
        return [e for e in self.entries if not e.used]


def imports_of(nm, archives):
    """Demangled names that the archives use and do not define."""
    used, defined = set(), set()
    for line in output(nm, "-P", *archives).splitlines():
        fields = line.split()
        if len(fields) >= 2 and len(fields[1]) == 1:
            (used if fields[1] in "Uw" else defined).add(fields[0])
    return demangled(used - defined - {"_GLOBAL_OFFSET_TABLE_"})


def demangled(names):
    names = sorted(names)
    return set(output("c++filt", text="\n".join(names)).splitlines()) if names else set()


def calls_of(objdump, program):
    """{function: functions it refers to}, demangled; a part split off by the compiler counts as the function itself."""
    calls, current = collections.defaultdict(set), None
    tail = re.compile(r"( \[clone [^\]]*\])+$")
    for line in output(objdump, "-dC", "--no-show-raw-insn", program).splitlines():
        head = re.fullmatch(r"[0-9a-f]+ <(.+)>:", line)
        if head:
            current = tail.sub("", head[1])
        elif current is not None and (target := re.search(r"<(.+)>$", line)):
            calls[current].add(tail.sub("", re.sub(r"[+-]0x[0-9a-f]+$", "", target[1])))
    return calls


def reaching(calls, forbidden):
    """{function: the call that leads it, maybe through others, to a forbidden one}"""
    callers = collections.defaultdict(set)
    for function, called in calls.items():
        for name in called - {function}:
            callers[name].add(function)
    via, open_ends = {}, [name for name in callers if forbidden(name)]
    while open_ends:
        name = open_ends.pop()
        for function in callers[name]:
            if function not in via and not function.endswith("@plt"):
                via[function] = name
                open_ends.append(function)
    return via


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", required=True, help="symbols.txt")
    parser.add_argument("--program", required=True, help="a program that links the whole archives")
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--objdump", default="objdump")
    parser.add_argument("archives", nargs="+")
    options = parser.parse_args()
    allowed, errors = List(options.list), []

    start_up_imports = set()
    for name in sorted(imports_of(options.nm, options.archives)):
        if allowed.fits("start-up-import", name):
            start_up_imports.add(name)
        elif not allowed.fits("import", name):
            errors.append(f"the archives import {name}, which is not in the list")
    via = reaching(calls_of(options.objdump, options.program), lambda name: name.removesuffix("@plt") in start_up_imports)
    for function, called in sorted(via.items()):
        if not allowed.fits("start-up", function):
            errors.append(f"{function} calls {called}: only a start-up function in the list may get there")
    errors += [f"{e.where}: nothing fits '{e.pattern}' any more: remove the line" for e in allowed.stale()]
    if errors:
        sys.exit("\n".join(errors))
    print(f"{len(start_up_imports)} start-up imports, reached from {len(via)} functions, all of them listed")


if __name__ == "__main__":
    main()
