# liealign from a fresh machine: Debian 12 (or alike) with make, git, Python 3.11 and root or sudo.
# Each target installs what is missing and works below build/ only.
# SPDX-License-Identifier: Apache-2.0

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= python3
WERROR ?= ON
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
APT_PACKAGES := build-essential cmake ninja-build libeigen3-dev libgtest-dev libtomlplusplus-dev libcli11-dev \
  python3-venv python3-dev ccache

# What `make bench` wants besides.
BENCH_APT_PACKAGES := libbenchmark-dev

# What `make test` wants besides: a browser that draws the report, and for the C++ checks what follows it. .clang-format and
# .clang-tidy are written for version 14, Debian 12's.
TEST_APT_PACKAGES := chromium clang clang-format clang-tidy

BUILD := build
RELEASE := $(BUILD)/release
TESTED := $(BUILD)/tested
SANITIZED := $(BUILD)/sanitized
BENCH := $(BUILD)/bench
TIDY := $(BUILD)/.tidy
VENV := $(BUILD)/venv
BIN := $(VENV)/bin
TOOLS_READY := $(BUILD)/.tools-ready
TEST_TOOLS_READY := $(BUILD)/.test-tools-ready
VENV_READY := $(BUILD)/.venv-ready
BENCH_READY := $(BUILD)/.bench-ready
INSTALLED := $(BUILD)/.installed
TEST_INSTALLED := $(BUILD)/.test-installed

PRINT_BUILD_REQUIREMENTS := import tomllib; \
  print(*tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"], sep="\n")

CPP_FILES := $(sort $(shell find cpp bindings tests/cpp benchmarks -name '*.[ch]pp' 2>/dev/null))

# Everything the wheel is made of. The directories are there for the sake of files that were removed.
WHEEL_SOURCES := CMakeLists.txt pyproject.toml $(wildcard cmake/*.cmake) \
  $(shell find cpp bindings python -name __pycache__ -prune -o \
    \( -type d -o -name '*.cpp' -o -name '*.hpp' -o -name '*.py' -o -name '*.pyi' -o -name py.typed -o -path '*/report/page.*' \) -print 2>/dev/null)

export CMAKE_BUILD_PARALLEL_LEVEL := $(JOBS)
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help demo test format sanitized tidy wheel post bench alignment honest reproduce clean

help:
	@echo "make demo       simulate a flight, align it and show the result"
	@echo "make test       build and run every test and check, C++ and Python"
	@echo "make wheel      check that pip install . needs nothing but a compiler"
	@echo "make post       the standalone executable, for this machine: build/release/liealign-post"
	@echo "make bench      every benchmark; writes benchmarks/README.md (a quarter of an hour)"
	@echo "make alignment  headings of thousands of simulated flights; writes benchmarks/alignment.md"
	@echo "make honest     are the stated sigmas true, case by case; writes docs/validation.md"
	@echo "make reproduce  the papers' tables and figures; writes docs/reproduction.md (half an hour)"
	@echo "make clean      remove build/"

demo: $(INSTALLED)
	$(BIN)/liealign demo

# pytest comes last, so that the output ends with its summary.
test: format sanitized tidy $(TEST_INSTALLED)
	ctest --test-dir $(TESTED) --output-on-failure --parallel $(JOBS)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	LIEALIGN_POST=$(abspath $(TESTED)/liealign-post) $(BIN)/pytest --numprocesses $(JOBS) --dist loadfile

format: | $(TEST_TOOLS_READY)
	clang-format --dry-run -Werror $(CPP_FILES)

# Simulated flights in numbers take minutes under the sanitizers. Results.* runs one whole flight from file to file instead.
# The last one builds a program without the sanitizers on the library.
SLOW_SANITIZED := ^(Alignment|Clock|Consistency|Honest|Output|Pipeline|Sbet|Units)\.|^Smoother\.is_better|^Truth\.(Follows|MeanSamples)|^cmake_consumer|Bank\.|StartCorrection\.a_|^Study\.(gives|nees|gimbal)

# One build for two checks: no warning under clang, no fault under AddressSanitizer and UndefinedBehaviorSanitizer. -O1: at -O0
# it builds faster, but one whole flight takes minutes. Single threaded: without Debian's libomp clang has no OpenMP.
$(SANITIZED)/CMakeCache.txt: Makefile | $(TEST_TOOLS_READY)
	cmake -G Ninja -S . -B $(SANITIZED) -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=Debug \
	  -DCMAKE_CXX_FLAGS_DEBUG='-O1 -g1' -DLIEALIGN_TESTS=ON -DLIEALIGN_POST=ON -DLIEALIGN_WERROR=$(WERROR) \
	  -DCMAKE_DISABLE_FIND_PACKAGE_OpenMP=ON -DLIEALIGN_SANITIZE=address,undefined -DLIEALIGN_UNITY=ON
	@touch $@

sanitized: $(SANITIZED)/CMakeCache.txt
	cmake --build $(SANITIZED) --parallel $(JOBS)
	ctest --test-dir $(SANITIZED) --output-on-failure --parallel $(JOBS) --exclude-regex '$(SLOW_SANITIZED)'

# clang-tidy on library and executable. It walks Eigen and the standard library anew for every source, so it reads the unity
# files of the sanitized build, the largest first. Their headers come along; the tests, mostly macros of GoogleTest, do not.
tidy: $(TIDY)

$(TIDY): .clang-tidy $(CPP_FILES) $(SANITIZED)/CMakeCache.txt
	cmake -S . -B $(SANITIZED) >/dev/null
	cmake --build $(SANITIZED) --target CMakeFiles/liealign_core.dir/cmake_pch.hxx.pch CMakeFiles/liealign_hot.dir/cmake_pch.hxx.pch
	ls -S $(SANITIZED)/CMakeFiles/liealign_*.dir/Unity/*.cxx cpp/app/*.cpp | \
	  xargs -P $(JOBS) -n 1 clang-tidy --quiet -p $(SANITIZED)
	@touch $@

# `pip install .` as a user without any of the above has it: in a virtualenv of its own that holds the build requirements and
# nothing else, with Eigen from PyPI. Without system paths CMake sees no system Eigen. pip would isolate the build by itself, but
# each time at another path, and then no compilation is found again.
wheel: | $(TOOLS_READY)
	$(PYTHON) -m venv --clear $(BUILD)/wheel-venv
	$(PYTHON) -c '$(PRINT_BUILD_REQUIREMENTS)' >$(BUILD)/build-requirements.txt
	$(BUILD)/wheel-venv/bin/python -m pip install --quiet -r $(BUILD)/build-requirements.txt
	CMAKE_ARGS=-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF $(BUILD)/wheel-venv/bin/python -m pip install --quiet \
	  --no-build-isolation --config-settings=build-dir=$(BUILD)/wheel .
	$(BUILD)/wheel-venv/bin/liealign --version

# Built for the processor of this machine.
post: | $(TOOLS_READY)
	cmake -G Ninja -S . -B $(RELEASE) -DCMAKE_BUILD_TYPE=Release -DLIEALIGN_POST=ON \
	  -DLIEALIGN_NATIVE=ON
	cmake --build $(RELEASE) --target liealign-post --parallel $(JOBS)
	@$(RELEASE)/liealign-post --version
	@echo "made $(RELEASE)/liealign-post"

# Flights are made once and kept in $(BENCH)/flights. BENCH_FLAGS=--quick tries it on short ones.
BENCH_FLAGS ?=
bench: $(BENCH_READY)
	cmake -G Ninja -S . -B $(BENCH) -DCMAKE_BUILD_TYPE=Release -DLIEALIGN_POST=ON -DLIEALIGN_TESTS=OFF \
	  -DLIEALIGN_NATIVE=ON -DLIEALIGN_UNITY=ON -DLIEALIGN_BENCHMARKS=ON
	cmake --build $(BENCH) --parallel $(JOBS)
	$(BIN)/python benchmarks/run.py --build $(BENCH) $(BENCH_FLAGS)

# Every case of benchmarks/alignment.py; a part of it: ALIGNMENT_FLAGS='--case given -n 50'.
ALIGNMENT_FLAGS ?=
alignment: $(INSTALLED)
	$(BIN)/python benchmarks/alignment.py --jobs $(JOBS) --json $(BUILD)/alignment.json $(ALIGNMENT_FLAGS)

# Every case of benchmarks/honest.py; one of them: HONEST_FLAGS='--case metre -n 40'.
HONEST_FLAGS ?=
honest: $(INSTALLED)
	$(BIN)/python benchmarks/honest.py --jobs $(JOBS) --json $(BUILD)/honest.json $(HONEST_FLAGS)

# Every section of reproduction/reproduce.py; one of them: REPRODUCE_FLAGS='--only tables'.
REPRODUCE_FLAGS ?=
reproduce: $(INSTALLED)
	$(BIN)/python -m pip install --quiet matplotlib scipy
	$(BIN)/python reproduction/reproduce.py --jobs $(JOBS) $(REPRODUCE_FLAGS)

clean:
	rm -rf $(BUILD)

# A compiler, CMake, Ninja, Eigen, GoogleTest, toml++, CLI11 and a Python that can make a virtualenv and compile against itself.
# apt is asked only when one of them is missing.
$(TOOLS_READY): Makefile
	@have() { command -v "$$1" >/dev/null 2>&1; }; \
	header() { echo "#include <$$1>" | c++ -E -x c++ - >/dev/null 2>&1; }; \
	python_ok() { $(PYTHON) -c 'import ensurepip, os, sysconfig, venv; \
	  raise SystemExit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))' 2>/dev/null; }; \
	missing() { \
	  for tool in c++ cmake ninja; do have $$tool || echo $$tool; done; \
	  header eigen3/Eigen/Core || header Eigen/Core || echo Eigen; \
	  header gtest/gtest.h || echo GoogleTest; \
	  header toml++/toml.h || echo toml++; \
	  header CLI/CLI.hpp || echo CLI11; \
	  python_ok || echo "the venv module or the headers of $(PYTHON)"; }; \
	lacks=$$(missing | paste -sd, -); \
	if [ -n "$$lacks" ] && have apt-get; then \
	  as_root=; if [ "$$(id -u)" -ne 0 ]; then as_root=sudo; fi; \
	  if [ -n "$$as_root" ] && ! have sudo; then \
	    echo "missing: $$lacks; as root, run: apt-get install $(APT_PACKAGES)" >&2; exit 1; fi; \
	  echo "missing: $$lacks; installing $(APT_PACKAGES)"; \
	  $$as_root apt-get update -q; \
	  $$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $(APT_PACKAGES); \
	  lacks=$$(missing | paste -sd, -); \
	fi; \
	if [ -n "$$lacks" ]; then echo "warning: not found: $$lacks; going on, CMake may know better" >&2; fi; \
	$(PYTHON) -c 'import sys; raise SystemExit(sys.version_info < (3, 11))' || { \
	  echo "liealign needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1); run make PYTHON=..." >&2; \
	  exit 1; }
	@mkdir -p $(BUILD)
	@touch $@

# clang with its sanitizers' library (which has the version in its package name), clang-format and clang-tidy: for `make test`
# and `make tidy` alone.
$(TEST_TOOLS_READY): Makefile | $(TOOLS_READY)
	@have() { command -v "$$1" >/dev/null 2>&1; }; \
	sanitizes() { echo 'int main() {}' | clang++ -fsanitize=address,undefined -x c++ - -o $(BUILD)/.sanitizes 2>/dev/null; }; \
	browses() { have chromium || have chromium-browser || have google-chrome; }; \
	missing() { \
	  for tool in ccache clang++ clang-format clang-tidy; do have $$tool || echo $$tool; done; \
	  sanitizes || echo "the sanitizers of clang++"; \
	  browses || echo chromium; }; \
	install() { \
	  as_root=; if [ "$$(id -u)" -ne 0 ] && have sudo; then as_root=sudo; fi; \
	  $$as_root apt-get update -q && \
	  $$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$$@"; }; \
	if [ -n "$$(missing)" ] && have apt-get; then \
	  echo "missing: $$(missing | paste -sd, -); installing $(TEST_APT_PACKAGES)"; \
	  install ccache $(TEST_APT_PACKAGES) || true; \
	  if have clang++ && ! sanitizes; then install libclang-rt-$$(clang++ -dumpversion | cut -d. -f1)-dev || true; fi; \
	fi; \
	browses || echo "warning: no chromium: the report will not be drawn" >&2; \
	have ccache || echo "warning: no ccache: what has not changed is compiled anew in each build directory" >&2; \
	lacks=$$(missing | grep -vx 'ccache\|chromium' | paste -sd, -) || true; \
	if [ -n "$$lacks" ]; then \
	  echo "make test needs $$lacks; install clang, clang-format and clang-tidy, version 14 or newer" >&2; exit 1; fi
	@touch $@

# The virtualenv holds the build requirements as well: with them at a fixed place, pip builds only what has changed.
$(VENV_READY): pyproject.toml | $(TOOLS_READY)
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -c '$(PRINT_BUILD_REQUIREMENTS)' >$(BUILD)/build-requirements.txt
	$(BIN)/python -m pip install --quiet -r $(BUILD)/build-requirements.txt
	@touch $@

# Google Benchmark, numpy and scipy; and GTSAM to compare with, which not every machine has a wheel for.
$(BENCH_READY): Makefile $(VENV_READY)
	@header() { echo "#include <$$1>" | c++ -E -x c++ - >/dev/null 2>&1; }; \
	if ! header benchmark/benchmark.h && command -v apt-get >/dev/null 2>&1; then \
	  as_root=; if [ "$$(id -u)" -ne 0 ] && command -v sudo >/dev/null 2>&1; then as_root=sudo; fi; \
	  echo "missing: Google Benchmark; installing $(BENCH_APT_PACKAGES)"; \
	  { $$as_root apt-get update -q && \
	    $$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $(BENCH_APT_PACKAGES); } || \
	    echo "warning: no Google Benchmark; the kernels are left out" >&2; \
	fi
	$(BIN)/python -m pip install --quiet numpy scipy
	$(BIN)/python -m pip install --quiet gtsam==4.3.0 || \
	  echo "warning: no GTSAM for this Python; the comparison with it is left out" >&2
	@touch $@

$(INSTALLED): $(VENV_READY) $(WHEEL_SOURCES)
	$(BIN)/python -m pip install --quiet --no-build-isolation .
	@touch $@

# The same with what the tests want. One build makes the wheel, the C++ tests and the executable, so that nothing is compiled twice;
# the executable is compared with the wheel, bit for bit.
$(TEST_INSTALLED): $(VENV_READY) $(WHEEL_SOURCES) $(CPP_FILES) tests/cpp/CMakeLists.txt
	CMAKE_ARGS='-DLIEALIGN_TESTS=ON -DLIEALIGN_POST=ON -DLIEALIGN_WERROR=$(WERROR)' $(BIN)/python -m pip install --quiet \
	  --no-build-isolation --config-settings=build-dir=$(TESTED) '.[test,dev]'
	@touch $@ $(INSTALLED)
