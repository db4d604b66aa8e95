"""The symbol scan finds what it is for, in libraries made here with the host's compiler."""

import shutil
import subprocess
from pathlib import Path

import pytest
import symbol_scan

# Flags of the flight libraries that matter here.
FLAGS = ["-std=c++20", "-O2", "-fno-exceptions", "-fno-rtti"]

BREACHES = [
    ("#include <cstdlib>\nvoid* f(int n) { return std::malloc(n); }", "heap"),
    ("int* f(int n) { return new int[n]; }", "heap"),
    ("void f(int* p) { delete p; }", "heap"),
    ("struct A { virtual ~A(); };\nA::~A() {}", "heap"),
    ("#include <vector>\nvoid f(std::vector<int>& v) { v.push_back(1); }", "heap"),
    ('#include <cstdio>\nvoid f(int a) { std::printf("%d", a); }', "print"),
    ('#include <cstdio>\nvoid f() { std::printf("text\\n"); }', "print"),
    ("#include <iostream>\nvoid f(int a) { std::cout << a; }", "print"),
    ('#include <cstdio>\nvoid* f() { return std::fopen("a", "r"); }', "file"),
    ("#include <chrono>\nlong f() { return std::chrono::steady_clock::now().time_since_epoch().count(); }", "clock"),
    ("#include <ctime>\nlong f() { return std::time(nullptr); }", "clock"),
    ("#include <time.h>\nint f(timespec* t) { return clock_gettime(CLOCK_MONOTONIC, t); }", "clock"),
    ("#include <cstdlib>\nint f() { return std::rand(); }", "random number"),
    ("#include <pthread.h>\nint f(pthread_mutex_t* m) { return pthread_mutex_lock(m); }", "thread"),
    ("#include <array>\nint f(std::array<int, 3>& a, int i) { return a.at(i); }", "exception"),
    ("#include <cmath>\ndouble f(double a) { return std::sin(a); }", "inexact function"),
    ("#include <cmath>\nfloat f(float a, float b) { return std::atan2(a, b); }", "inexact function"),
]

CLEAN = [
    "#include <cmath>\ndouble f(double a) { return std::sqrt(a) + std::floor(a); }",
    "struct A { virtual void f() = 0; protected: ~A() = default; };\nvoid g(A& a) { a.f(); }",
    "#include <atomic>\nvoid f(std::atomic<int>& a) { a.store(1); }",
    "#include <cstring>\nvoid f(char* a, int n) { std::memset(a, 0, n); }",
]


def library(folder: Path, source: str, flags: list[str]) -> str:
    """Compiles one source into a static library."""
    compiler = shutil.which("g++")
    assert compiler, "g++ comes with tools/setup"
    (folder / "part.cpp").write_text(source)
    subprocess.run([compiler, *flags, "-c", "part.cpp", "-o", "part.o"], cwd=folder, check=True)
    subprocess.run(["ar", "rcs", "libpart.a", "part.o"], cwd=folder, check=True)
    return str(folder / "libpart.a")


@pytest.mark.parametrize(("source", "why"), BREACHES)
def test_finds_a_breach(tmp_path: Path, source: str, why: str) -> None:
    found = symbol_scan.check(library(tmp_path, source, FLAGS))
    assert any(breach.endswith(": " + why) for breach in found), found


@pytest.mark.parametrize("source", CLEAN)
def test_leaves_the_rest_alone(tmp_path: Path, source: str) -> None:
    assert symbol_scan.check(library(tmp_path, source, FLAGS)) == []


def test_finds_an_exception_in_code_built_with_them(tmp_path: Path) -> None:
    found = symbol_scan.check(library(tmp_path, "void f() { throw 1; }", ["-std=c++20", "-O2"]))
    assert any("__cxa_throw: exception" in breach for breach in found)


def test_the_command_fails_on_a_breach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    breach = library(tmp_path, BREACHES[0][0], FLAGS)
    assert symbol_scan.main([breach]) == 1
    assert "part.o: malloc: heap" in capsys.readouterr().out
    assert symbol_scan.main([library(tmp_path, CLEAN[0], FLAGS)]) == 0


def test_a_library_without_code_is_no_proof(tmp_path: Path) -> None:
    assert symbol_scan.check(library(tmp_path, "", FLAGS)) != []


@pytest.mark.parametrize("symbol", ["sinter", "freexp", "timeout", "opening", "memcpy", "__stack_chk_fail", "_ZN5plumb4timeEv"])
def test_a_name_that_only_begins_alike_is_no_breach(symbol: str) -> None:
    assert symbol_scan.reason_against(symbol) is None


@pytest.mark.parametrize("symbol", ["__printf_chk", "snprintf", "vsnprintf", "fputs", "_Znwm", "_ZdlPvm", "malloc@GLIBC_2.2.5"])
def test_every_spelling_is_a_breach(symbol: str) -> None:
    assert symbol_scan.reason_against(symbol) is not None
