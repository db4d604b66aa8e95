#!/usr/bin/env python3
"""What flight code may not call: no heap, no exception, no print, no file, no clock, no random number, no thread, and
no function of the C library whose bits depend on the machine (fsw/math/exact.h has them).

    test/checks/symbol_scan.py LIBRARY.a...

Looks with nm at what the object files of each static library need from elsewhere, prints one line per breach
(library: object: symbol: why) and exits with 1 when there is one. An optimised build is scanned: without inlining, the
headers of libraries leave references that no flight program has.
"""

import re
import subprocess
import sys

# Mangled names, whole: nothing is demangled, so nothing depends on how a tool spells a type.
BANNED = {
    "heap": r"malloc|calloc|realloc|reallocarray|free|aligned_alloc|posix_memalign|memalign|strdup|mmap|sbrk"
    r"|_Zn[wa]\w*|_Zd[la]\w*",  # operator new, new[], delete, delete[]
    "exception": r"__cxa_(throw|rethrow|allocate_exception|begin_catch|free_exception)|_Unwind_\w+|__gxx_personality_v0"
    r"|_ZSt\d+__throw_\w+",
    "print": r"(__)?v?(f|s|sn|d|as)?w?printf(_chk)?|f?puts|f?putc|putchar|fwrite|perror|v?syslog"
    r"|_ZSt4(cout|cerr|clog)|_ZNSo\w+|_ZStls\w+|_ZNSt8ios_base\w+",
    "file": r"fopen(64)?|freopen(64)?|fdopen|open(at)?(64)?|creat(64)?|fread|_ZNSt(13|14)basic_[io]?f\w+",
    "clock": r"clock_gettime|clock_getres|gettimeofday|time|times|clock|localtime(_r)?|gmtime(_r)?|_ZNSt6chrono\w+",
    "waiting": r"(clock_)?nanosleep|usleep|sleep|select|poll|epoll_wait|futex",
    "random number": r"s?rand(om)?|rand_r|[delmnj]rand48|getrandom|getentropy|_ZNSt13random_device\w+",
    "thread": r"pthread_\w+|sem_\w+|_ZNSt6thread\w+|_ZNSt18condition_variable\w+|_ZNSt11this_thread\w+",
    "inexact function": r"(a?(sin|cos|tan)h?|atan2|sincos|exp(2|10|m1)?|log(2|10|1p|b)?|pow|cbrt|hypot|erfc?"
    r"|[lt]gamma(_r)?)[fl]?",
    "environment": r"(secure_)?getenv|system|exec[lv]p?e?|v?fork",
}
_BANNED = {why: re.compile(pattern) for why, pattern in BANNED.items()}


def reason_against(symbol: str) -> str | None:
    """Why flight code may not need the symbol, or nothing."""
    name = symbol.split("@")[0]
    for why, pattern in _BANNED.items():
        if pattern.fullmatch(name):
            return why
    return None


def symbols(library: str) -> list[tuple[str, str, str]]:
    """(object file, symbol, kind) for everything the library defines or needs."""
    command = ["nm", "--no-demangle", "--print-file-name", "--format=posix", library]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # LIBRARY[OBJECT]: SYMBOL KIND ...
    return re.findall(r"\[([^\]]+)\]: (\S+) (\w)", listing)


def check(library: str) -> list[str]:
    """Every breach of one library."""
    listed = symbols(library)
    if not listed:
        return [f"{library}: holds no symbols, so it is not a static library with code in it"]
    return [
        f"{library}: {member}: {symbol}: {why}"
        for member, symbol, kind in listed
        if kind in "Uwv" and (why := reason_against(symbol)) is not None
    ]


def main(libraries: list[str]) -> int:
    """Scans the libraries named on the command line."""
    if not libraries:
        print(__doc__, file=sys.stderr)
        return 2
    found = [breach for library in libraries for breach in check(library)]
    print("\n".join(found) if found else f"symbol scan: {len(libraries)} libraries, no breach")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
