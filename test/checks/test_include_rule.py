"""The include rule finds what it is for, and leaves alone what is allowed."""

from pathlib import Path

import include_rule
import pytest

BREACHES = [
    ("fsw/base/a.h", '#include "fsw/math/so3.h"', "may not include"),
    ("fsw/base/a.h", "#include <Eigen/Core>", "<Eigen/Core>"),
    ("fsw/base/a.h", "#include <vector>", "<vector>"),
    ("fsw/base/a.inl", "#include <vector>", "<vector>"),
    ("fsw/base/a.h", "  #  include <chrono>", "<chrono>"),
    ("fsw/base/a.h", "#include <unistd.h>", "<unistd.h>"),
    ("fsw/measurement/a.h", '#include "fsw/math/so3.h"', "may not include"),
    ("fsw/estimator/a.cpp", '#include "fsw/vision/ransac.h"', "may not include"),
    ("fsw/estimator/deep/a.cpp", '#include "fsw/vision/ransac.h"', "may not include"),
    ("fsw/vision/a.cpp", '#include "fsw/estimator/state.h"', "may not include"),
    ("fsw/vision/a.cpp", "#include <opencv2/core.hpp>", "<opencv2/core.hpp>"),
    ("fsw/predictor/a.cpp", '#include "fsw/estimator/state.h"', "may not include"),
    ("fsw/params/a.cpp", '#include "hal/include/clock.h"', "may not include"),
    ("fsw/app/a.cpp", '#include "hal/linux/clock.h"', "may not include"),
    ("fsw/app/a.cpp", '#include "drivers/stim300/protocol.h"', "may not include"),
    ("fsw/app/a.cpp", "#include <lcm/lcm-cpp.hpp>", "<lcm/lcm-cpp.hpp>"),
    ("fsw/params/a.cpp", '#include "plumb_lcm/nav_state.hpp"', "is generated for"),
    ("drivers/stim300/a.cpp", '#include "fsw/estimator/estimator.h"', "may not include"),
    ("drivers/stim300/a.cpp", "#include <thread>", "<thread>"),
    ("fsw/estimator/a.cpp", "#include <thread>", "<thread>"),
    ("fsw/estimator/a.cpp", "#include <mutex>", "<mutex>"),
    ("hal/include/a.h", '#include "hal/linux/clock.h"', "may not include"),
    ("hal/linux/a.cpp", '#include "fsw/estimator/estimator.h"', "may not include"),
    ("hal/linux/a.cpp", '#include "test/support/property.h"', "may not include"),
    ("tools/replay/a.cpp", '#include "test/support/property.h"', "may not include"),
    ("fsw/base/a.h", '#include "time.h"', "not named from the root"),
    ("fsw/base/a.h", '#include "../base/time.h"', "not named from the root"),
    ("fsw/novelty/a.h", "", "no rule for this folder"),
    ("fsw/base/a.cpp", "void f() { throw 1; }", "'throw'"),
    ("fsw/base/a.cpp", "int* f() { return new int; }", "'new'"),
    ("fsw/base/a.cpp", "void f(int* p) { delete p; }", "'delete'"),
    ("fsw/base/a.cpp", "auto* d = dynamic_cast<D*>(b);", "'dynamic_cast'"),
    ("drivers/stim300/a.cpp", "int* f() { return new int; }", "'new'"),
    ("fsw/base/a.cpp", "int a;\n" * 401, "401 lines"),
    ("hal/linux/a.cpp", "int a;\n" * 401, "401 lines"),
]

ALLOWED = [
    ("fsw/base/a.h", "#include <array>"),
    ("fsw/base/a.h", '#include "fsw/base/time.h"'),
    ("fsw/math/a.h", "#include <Eigen/Core>"),
    ("fsw/vision/a.cpp", "#include <opencv2/core/hal/intrin.hpp>"),
    ("fsw/estimator/a.cpp", '#include "fsw/vision/feature_frame.h"'),
    ("fsw/estimator/a.cpp", '#include "fsw/vision/tracker.h"'),
    ("fsw/telemetry/a.cpp", '#include "plumb_lcm/nav_state.hpp"'),
    ("fsw/app/a.cpp", '#include "fsw/estimator/estimator.h"'),
    ("fsw/app/a.cpp", '#include "hal/include/clock.h"'),
    ("drivers/stim300/a.cpp", '#include "hal/include/serial_port.h"'),
    ("hal/linux/a.cpp", "#include <termios.h>"),
    ("test/unit/base/a.cpp", '#include "test/support/property.h"'),
    ("fsw/base/a.cpp", "// A new idea: never throw; try to delete nothing."),
    ("fsw/base/a.cpp", "/* new\n   throw */ int a;"),
    ("fsw/base/a.cpp", 'const char* a = "throw \\" new";'),
    ("fsw/base/a.cpp", "struct A { A(const A&) = delete; };"),
    ("fsw/base/a.cpp", "int new_value = 1'000; int thrown = 0;"),
    ("hal/linux/a.cpp", "int* f() { return new int; }"),
    ("fsw/base/a.cpp", "int a;\n" * 400),
    ("test/unit/base/a.cpp", "int a;\n" * 500),
]


@pytest.mark.parametrize(("path", "source", "text"), BREACHES)
def test_finds_a_breach(path: str, source: str, text: str) -> None:
    found = include_rule.breaches_of(path, source)
    assert len(found) == 1
    assert found[0].startswith(path + ":")
    assert text in found[0]


@pytest.mark.parametrize(("path", "source"), ALLOWED)
def test_leaves_the_rest_alone(path: str, source: str) -> None:
    assert include_rule.breaches_of(path, source) == []


def test_a_breach_stands_on_its_own_line() -> None:
    source = "#include <array>\n/* two\nlines */\nvoid f() { throw 1; }\n"
    assert include_rule.breaches_of("fsw/base/a.cpp", source)[0].startswith("fsw/base/a.cpp:4:")


def test_the_command_fails_on_a_breach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "fsw" / "base" / "a.h"
    file.parent.mkdir(parents=True)
    file.write_text("#pragma once\n#include <map>\n")
    assert include_rule.main([str(tmp_path)]) == 1
    assert "fsw/base/a.h:2:" in capsys.readouterr().out
    file.write_text("#pragma once\n")
    assert include_rule.main([str(tmp_path)]) == 0
