# dqwatch. `make help` explains every target.
BUILD    ?= build
DATA     ?= ../shared/data
CC       ?= cc
CXX      ?= c++
OPT      ?= -O2
UNITY_DIR ?= $(TOP)/unity

# All cores, unless -j says otherwise.
ifeq ($(MAKELEVEL)$(filter -j%,$(MAKEFLAGS)),0)
MAKEFLAGS += -j$(shell nproc)
endif

# The sanitized tests are built by a second make into $(BUILD)/asan, by Clang $(BUILD)/asan-clang; Unity stays in one
# place.
TOP      := $(BUILD)
ifdef SANITIZE
TOP      := $(patsubst %/asan,%,$(BUILD:-clang=))
SANFLAGS := -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g1
# What these four ask of each access to Eigen's arrays AddressSanitizer asks as well, or the processor; C is asked all.
SANCXX   := -fno-sanitize=null,alignment,object-size,vptr
OPT      := -O1
# What does not compute builds faster than it runs.
QUICKOPT := -O0
endif
QUICKOPT ?= $(OPT)
TESTOPT  := -O0
# What a trace computes, sooner and with the same numbers: a row clears and copies some hundred bytes here and there,
# for which GCC's generic tuning of x86-64 takes an instruction that is long to start, a sixth of the time.
TUNE     := $(if $(filter x86_64-%,$(shell $(CXX) -dumpmachine 2>/dev/null)),-mtune=haswell)
REFOPT   := $(if $(SANITIZE)$(filter-out file,$(origin OPT)),$(OPT),-O3 $(TUNE))

WARN     := -Wall -Wextra -Wshadow
LIBWARN  := $(WARN) -Wconversion -Wsign-conversion -Wdouble-promotion
# A line of packages/facts.toml: a text, or a list's items.
fact      = $(shell sed -n 's/^$(1) = //p' packages/facts.toml | sed 's/", "/ /g; s/[]["]//g')
FP       := $(call fact,float_flags)
# app/ and ref/ have rooms: their files are included by their whole path.
INC      := -I. -Ilib -Iport_q15 -Isim
# Ceres' and Eigen's headers as system headers: their warnings are not ours.
CXXINC   := $(INC) -isystem /usr/include/eigen3
CFLAGS   ?=
CXXFLAGS ?=
# The Python module takes the archives in.
PIC      := -fPIC -fno-semantic-interposition
C99      := -std=c99 -pedantic -Werror=implicit-function-declaration $(PIC) $(OPT) $(FP) $(SANFLAGS) -MMD -MP
CXX17    := -std=c++17 $(PIC) $(OPT) $(FP) $(SANFLAGS) $(SANCXX) -MMD -MP

# The headers that most of C++ reads, read once for each way to compile it, and anew by another compiler or other flags.
USUAL    := algorithm array cmath cstdint functional map memory optional string vector Eigen/Core
USUALDIR := $(BUILD)/usual/$(shell (echo '$(USUAL) $(CXX17) $(REFOPT) $(QUICKOPT) $(TESTOPT) $(CXXFLAGS)'; $(CXX) --version) 2>/dev/null | cksum | cut -d' ' -f1)
usual     = $(USUALDIR)/$(1)/usual.hpp

# SUNDIALS 7 moved its context into a library of its own, and Debian builds it with MPI, whose header its own then
# include.
SUNCORE  := $(shell echo 'int main(void){return 0;}' | $(CC) -x c - -lsundials_core -o /dev/null 2>/dev/null && echo -lsundials_core)
ifneq ($(SUNCORE),)
MPIINC   := $(shell pkg-config --cflags mpi-c 2>/dev/null)
MPILIBS  := $(shell pkg-config --libs mpi-c 2>/dev/null)
endif
SUNLIBS  := -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense \
            -lsundials_sunnonlinsolfixedpoint $(SUNCORE) $(MPILIBS)
CERESLIBS = -lceres -lglog -lfmt -lz -lzstd -pthread

LIB_O := $(patsubst %.c,$(BUILD)/%.o,$(wildcard lib/*.c))
Q15_O := $(patsubst %.c,$(BUILD)/%.o,$(wildcard port_q15/*.c))
SIM_O := $(patsubst %.c,$(BUILD)/%.o,$(wildcard sim/*.c))
REF_O := $(patsubst %.cpp,$(BUILD)/%.o,$(wildcard ref/*/*.cpp))
APP_O := $(patsubst %.cpp,$(BUILD)/%.o,$(filter-out app/cmd/main.cpp,$(wildcard app/*/*.cpp))) $(BUILD)/app/page/asset_bytes.o
# The plotting library of the reports, and its licence, as Debian installs them.
DYGRAPHS ?= /usr/share/javascript/dygraphs
DYGRAPHS_LICENCE ?= /usr/share/doc/libjs-dygraphs
C_BENCHES := $(patsubst %,$(BUILD)/bench/%,sim_speed regressors usage accuracy tracking faults healthy scenarios step_sizes model_error plain_blocks)
ARCHIVES := $(BUILD)/libapp.a $(BUILD)/libref.a $(BUILD)/libsim.a $(BUILD)/libdqw_q15.a $(BUILD)/libdqw.a
# A test's binary is build/tests/test_NAME, whatever room its source is in.
TEST_C   := $(wildcard tests/*/test_*.c)
TEST_CXX := $(wildcard tests/*/test_*.cpp tests/*/*/test_*.cpp)
vpath test_%.c $(sort $(dir $(TEST_C)))
vpath test_%.cpp $(sort $(dir $(TEST_CXX)))
# A test that stays away from the sanitizers says so, and why.
PLAIN_ONLY := $(shell grep -l 'Plain only: ' $(TEST_C) $(TEST_CXX))
ifdef SANITIZE
TEST_C   := $(filter-out $(PLAIN_ONLY),$(TEST_C))
TEST_CXX := $(filter-out $(PLAIN_ONLY),$(TEST_CXX))
endif
binaries  = $(patsubst %,$(BUILD)/tests/%,$(basename $(notdir $(1))))
# The long ones first: none of them runs alone at the end.
LONG     := $(shell grep -l 'Plain only: long' $(TEST_C) $(TEST_CXX))
TESTS    := $(call binaries,$(LONG) $(filter-out $(LONG),$(TEST_C) $(TEST_CXX)))
# Two tests of one name would be one binary.
ifneq ($(words $(TESTS)),$(words $(sort $(TESTS))))
$(error two tests of one name: $(strip $(foreach t,$(sort $(TESTS)),$(if $(filter-out 1,$(words $(filter $(t),$(TESTS)))),$(notdir $(t))))))
endif
# What `make check` runs: C alone, and no other compilers.
CHECKED   = $(call binaries,$(filter-out $(shell grep -l 'Plain only: runs other programs' $(TEST_C)),$(TEST_C)))

## all          build build/dqwatch
.PHONY: all
all: $(BUILD)/dqwatch

## help         this list
.PHONY: help
help:
	@sed -n 's/^## //p' Makefile packages/install.mk

## demo         install what is missing, build, and run the main job: simulate, learn, fit, compare with the truth
.PHONY: demo
demo:
	@.ci/install build
	@$(MAKE) --no-print-directory all
	@$(BUILD)/dqwatch demo --out $(BUILD)/demo

## test         install what is missing, build, and run every test
.PHONY: test
test:
	@.ci/install build
	@.ci/unity $(UNITY_DIR)
	@$(MAKE) --no-print-directory run-tests

## check        lint's quick part and the tests in C, with a third of what they draw: after a change of lib/, port_q15/, sim/
.PHONY: check check-lint
check: check-lint $(CHECKED)
	@BUILD=$(BUILD) DATA=$(DATA) CC="$(CC)" CXX="$(CXX)" tests/run check $(CHECKED)
## check-lint   lint's quick part, which check runs beside the compilers
check-lint:
	@.ci/lint dependencies citations docstrings effects twins equivalents public-functions text

## mutants      change 300 lines of lib/ and of port_q15/, one at a time: what the tests in C do not see; SEED=N draws others. Hours
.PHONY: mutants
mutants:
	@.ci/install build
	@.ci/unity $(UNITY_DIR)
	@$(MAKE) --no-print-directory test-binaries
	@for folder in lib port_q15; do tests/mutants/mutants.py $$folder --sanitized --seed $(or $(SEED),1) --build $(BUILD); done

## fresh        README's two commands in a bare Debian 12 and a bare Debian 13: what is committed, installed by itself. As root; long
.PHONY: fresh
fresh:
	@BUILD=$(BUILD) .ci/fresh

# Clang builds them in two thirds of GCC's time; without it, or without its runtime, CC and CXX do.
QUICK_CC  = $(shell echo 'int main(void){return 0;}' | clang++ -x c++ -fsanitize=address,undefined - -o /dev/null 2>/dev/null && echo CC=clang CXX=clang++)
## sanitized    every test but the longest, under AddressSanitizer and UBSan
.PHONY: sanitized
sanitized:
	@.ci/install build
	@.ci/unity $(UNITY_DIR)
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/asan$(if $(QUICK_CC),-clang) SANITIZE=1 UNITY_DIR=$(UNITY_DIR) $(QUICK_CC) run-tests

## run-tests    build and run every test, install nothing
.PHONY: run-tests
run-tests: test-binaries
	@BUILD=$(BUILD) DATA=$(DATA) CC="$(CC)" CXX="$(CXX)" tests/run $(if $(SANITIZE),asan,plain) $(TESTS)

## test-binaries  build every test and build/dqwatch, run nothing
.PHONY: test-binaries
test-binaries: $(TESTS) $(BUILD)/dqwatch

$(UNITY_DIR)/unity.c:
	@.ci/unity $(UNITY_DIR)
$(addsuffix .o,$(TESTS)): | $(UNITY_DIR)/unity.c

include packages/install.mk

## tools        install the checkers that make lint uses
.PHONY: tools
tools:
	@.ci/install tools

## lint         compilers at their strictest, headers alone, poisoned names, citations, clang-tidy, cppcheck, format
.PHONY: lint
lint:
	@.ci/install build tools
	@.ci/lint

## twins        do the float files and their fixed-point twins have the same steps in the same words, and each pair some
.PHONY: twins
twins:
	@.ci/twins

## measured     fit and trace every measured log of DATA (default ../shared/data), and write docs/measured.md and docs/pictures
.PHONY: measured
measured:
	@.ci/install build
	@$(MAKE) --no-print-directory $(BUILD)/bench/measured
	@$(BUILD)/bench/measured $(DATA) docs/measured.md $(BUILD)/bench/reports
	@$(MAKE) --no-print-directory measured-vendors
	@bench/pictures.sh $(BUILD)/bench/reports docs/pictures
	@$(MAKE) --no-print-directory map-picture

## map-picture  README's picture: a measured machine's flux map as a log tells it, beside the measured one
.PHONY: map-picture
map-picture: $(BUILD)/bench/flux_map
	@mkdir -p $(BUILD)/bench/maps
	@DATA=$(DATA) $(BUILD)/bench/flux_map Baldor 0.01 11 $(BUILD)/bench/maps/flux_map.html
	@HEIGHT=1070 bench/pictures.sh $(BUILD)/bench/maps docs/pictures

## measured-vendors  the section of docs/measured.md on vendors' logs alone, from the folder vendor of DATA
.PHONY: measured-vendors
measured-vendors: $(BUILD)/dqwatch
	@python3 bench/vendors.py $(BUILD)/dqwatch $(DATA) docs/measured.md

## bench        accuracy, coverage, start values, tracking, faults and false alarms of the learners; regressor forms; speed; peers from their registries
.PHONY: bench
bench:
	@.ci/install build
	@$(MAKE) --no-print-directory all $(C_BENCHES) $(BUILD)/bench/flux_map $(BUILD)/tests/test_handover
	@BUILD=$(BUILD) $(STRANGERS_ENV) bench/run
	@echo
	@$(MAKE) --no-print-directory bench-fleet

STRANGERS_ENV = CC="$(CC)" SUNLIBS="$(SUNLIBS)" SUNINC="$(MPIINC)"
# The Python package with what the fleet needs, in an environment of its own.
FLEET_ENV := $(BUILD)/fleet/env
FLEET_OF  := $(wildcard python/pyproject.toml python/CMakeLists.txt python/core/* python/src/dqwatch/*.py \
             python/src/dqwatch/fleet/* python/src/dqwatch/fleet/*/* ref/*/*.cpp app/*/*.cpp lib/*.c sim/*.c)
$(FLEET_ENV)/made: $(FLEET_OF)
	@echo "dqwatch: building the Python package into $(FLEET_ENV): minutes, once"
	@python3 -m venv $(FLEET_ENV)
	@$(FLEET_ENV)/bin/pip install -q --disable-pip-version-check './python[fleet]'
	@touch $@

## fleet        a demo: the logs of 60 simulated motors, compared with each other; who stands out, and a page
.PHONY: fleet
fleet:
	@.ci/install build python
	@$(MAKE) --no-print-directory $(FLEET_ENV)/made
	@$(FLEET_ENV)/bin/python -m dqwatch.fleet.demo --out $(BUILD)/fleet/demo

## bench-fleet  a fleet of 1000 motors by a seed never used (SEED=N), the cost of DuckDB and Spark, the page of 10 000; an hour
.PHONY: bench-fleet
bench-fleet:
	@.ci/install build python
	@$(MAKE) --no-print-directory $(FLEET_ENV)/made
	@BUILD=$(BUILD) SEED=$(or $(SEED),1001) bench/fleet.sh

## strangers    the simulator's plant beside another project's, PHOBIA=, a git directory of rombrew/phobia, whose drives are monitored and traced; then 60 logs that other simulators draw, traced: SEED=N
.PHONY: strangers
strangers:
	@.ci/install build
	@$(MAKE) --no-print-directory all $(BUILD)/libsim.a $(BUILD)/dqwatch $(BUILD)/bench/campaign_reads
	@BUILD=$(BUILD) SEED=$(or $(SEED),1) $(STRANGERS_ENV) bench/strangers/run
	@echo
	@BUILD=$(BUILD) SEED=$(or $(SEED),1) bench/strangers/logs.sh

## python       wheels of the Python package, repaired, with all licences; installed into bare environments and tested there
.PHONY: python
python: $(BUILD)/dqwatch
	@BUILD=$(BUILD) DQWATCH_COMMAND=$(CURDIR)/$(BUILD)/dqwatch .ci/python

## live         two simulated motors on a page, one of which fails after a minute; Ctrl-C ends it; LISTEN=HOST:PORT
.PHONY: live
live:
	@.ci/install build
	@BUILD=$(BUILD) .ci/live
	@$(BUILD)/live/bin/dqwatch live --demo $(if $(LISTEN),--listen $(LISTEN))

## python-fresh the stable-ABI wheel in a bare Debian 13, on its own Python. As root
.PHONY: python-fresh
python-fresh:
	@BUILD=$(BUILD) .ci/python-fresh

## imperfections  what each imperfection of a drive does to the parameters, one simulated log each, into docs/imperfections.md
.PHONY: imperfections
imperfections: $(BUILD)/dqwatch
	python3 bench/imperfections.py $(BUILD)/dqwatch >$(BUILD)/imperfections.md && mv $(BUILD)/imperfections.md docs/imperfections.md

## campaign     drives by a seed through the command: coverage of deviations, faults named, false alarms, into docs/campaign.md; SEED=N. An hour
.PHONY: campaign
campaign: $(BUILD)/dqwatch $(BUILD)/bench/campaign_reads $(BUILD)/bench/plain_blocks
	python3 bench/campaign.py all --build $(BUILD) --seed $(or $(SEED),1) >$(BUILD)/campaign.md && mv $(BUILD)/campaign.md docs/campaign.md

## blind        trace 320 simulated logs whose effects a seed draws, and print the confusion table
.PHONY: blind
blind:
	@.ci/install build
	@$(MAKE) --no-print-directory $(BUILD)/bench/blind
	@$(BUILD)/bench/blind

## docs         the documentation site into build/site/html: pages, equations typeset, C and Python reference, notebooks run; links checked
.PHONY: docs
docs:
	@.ci/install build python docs
	@$(MAKE) --no-print-directory all $(BUILD)/docs/site/catalogue
	@BUILD=$(BUILD) docs/site/build

## firmware     run examples/ on a Cortex-M4F under QEMU, and write what the monitor costs there to docs/firmware.md
.PHONY: firmware
firmware:
	@.ci/install build tools
	@$(MAKE) --no-print-directory all
	@BUILD=$(BUILD) tests/target/firmware.sh docs/firmware.md

## target       run the fixed-point port with two compilers here and on five cores under QEMU, and compare every bit
.PHONY: target
target:
	@.ci/install build tools
	@BUILD=$(BUILD) tests/target/target.sh

# The fixed-point port and its tests where an overflow, a shift that C does not define, or a conversion that loses a bit
# or the sign ends the program.
TRAP      := -fsanitize=undefined,implicit-conversion -fsanitize-trap=all
Q15_TESTS  = $(call binaries,$(wildcard tests/port_q15/test_*.c))
## trap         every test of the fixed-point port in full, built with arithmetic that traps
.PHONY: trap
trap:
	@.ci/install build tools
	@.ci/unity $(UNITY_DIR)
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/trap UNITY_DIR=$(UNITY_DIR) CC=clang CFLAGS="$(TRAP)" $(Q15_TESTS:$(BUILD)/%=$(BUILD)/trap/%)
	@printf '%s\n' $(Q15_TESTS:$(BUILD)/%=$(BUILD)/trap/%) | xargs -P $(shell nproc) -I {} sh -c \
	    '{} >{}.log 2>&1; status=$$?; sed "s|^|{}: |" {}.log | tail -n 3; [ $$status = 0 ] || { echo "{}: status $$status"; exit 255; }'

## prove        the fixed-point arithmetic and the plain learner's step for every value, by Frama-C; the package is 290 MB, and Debian's
.PHONY: prove
prove:
	@.ci/install proof
	@tests/proof/prove.sh

## numbers      instructions, bytes and stack of a step on five cores, float and Q15, into docs/cost.md
.PHONY: numbers
numbers:
	@.ci/install build tools
	@BUILD=$(BUILD) tests/target/numbers.sh docs/cost.md

## clean        remove what was built
.PHONY: clean
clean:
	rm -rf $(BUILD)

$(BUILD)/lib/%.o: lib/%.c
	@mkdir -p $(@D)
	$(CC) $(C99) $(LIBWARN) -Ilib $(CFLAGS) -c $< -o $@
$(BUILD)/port_q15/%.o: port_q15/%.c
	@mkdir -p $(@D)
	$(CC) $(C99) $(LIBWARN) -Ilib -Iport_q15 $(CFLAGS) -c $< -o $@
$(BUILD)/sim/%.o: sim/%.c
	@mkdir -p $(@D)
	$(CC) $(C99) $(WARN) -Isim $(MPIINC) $(CFLAGS) -c $< -o $@
$(USUALDIR)/%/usual.hpp.gch:
	@mkdir -p $(@D)
	@printf '#include <%s>\n' $(USUAL) >$(basename $@)
	$(CXX) $(CXX17:-MMD=-MD) $($*OPT) $(CXXINC) $(CXXFLAGS) -x c++-header $(basename $@) -o $@
$(BUILD)/ref/%.o: WAY := REF
ifdef SANITIZE
# What asks for sums over rows builds faster than it runs as well.
$(BUILD)/ref/trace/%.o: WAY := QUICK
endif
$(BUILD)/ref/%.o: ref/%.cpp | $(call usual,REF).gch $(call usual,QUICK).gch
	@mkdir -p $(@D)
	$(CXX) $(CXX17) $($(WAY)OPT) $(WARN) -I. -isystem /usr/include/eigen3 -include $(call usual,$(WAY)) $(CXXFLAGS) -c $< -o $@
$(BUILD)/app/%.o: app/%.cpp | $(call usual,QUICK).gch
	@mkdir -p $(@D)
	$(CXX) $(CXX17) $(QUICKOPT) $(WARN) $(CXXINC) -include $(call usual,QUICK) $(CXXFLAGS) -c $< -o $@
$(BUILD)/app/page/asset_bytes.o: app/page/asset_bytes.S $(wildcard app/page/page.*s) $(DYGRAPHS)/dygraph.min.js $(DYGRAPHS)/dygraph.min.css
	@mkdir -p $(@D)
	$(CC) -Wa,-Iapp/page,-I$(DYGRAPHS),-I$(DYGRAPHS_LICENCE) -c $< -o $@
$(BUILD)/tests/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(C99) -D_POSIX_C_SOURCE=200809L $(WARN) $(INC) -Itests -isystem $(UNITY_DIR) -DUNITY_INCLUDE_DOUBLE $(CFLAGS) -c $< -o $@
# What computes is in lib/ and ref/: a test of the command builds faster than it would run.
$(BUILD)/tests/%.o: %.cpp | $(call usual,TEST).gch
	@mkdir -p $(@D)
	$(CXX) $(CXX17) $(TESTOPT) $(WARN) $(CXXINC) -include $(call usual,TEST) -Itests -isystem $(UNITY_DIR) -DUNITY_INCLUDE_DOUBLE $(CXXFLAGS) -c $< -o $@
$(BUILD)/bench/%.o: bench/%.c
	@mkdir -p $(@D)
	$(CC) $(C99) -D_POSIX_C_SOURCE=200809L $(WARN) $(INC) $(CFLAGS) -c $< -o $@
$(BUILD)/bench/%.o: bench/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CXX17) $(WARN) $(CXXINC) $(CXXFLAGS) -c $< -o $@
$(BUILD)/docs/%.o: docs/%.cpp
	@mkdir -p $(@D)
	$(CXX) $(CXX17) $(WARN) $(CXXINC) $(CXXFLAGS) -c $< -o $@
$(BUILD)/tests/unity.o: $(UNITY_DIR)/unity.c
	@mkdir -p $(@D)
	$(CC) $(OPT) $(SANFLAGS) -DUNITY_INCLUDE_DOUBLE -c $< -o $@

# An archive is made anew, so that an object whose source is gone is gone too.
$(BUILD)/libdqw.a: $(LIB_O)
	@rm -f $@; ar rcs $@ $^
$(BUILD)/libdqw_q15.a: $(Q15_O)
	@rm -f $@; ar rcs $@ $^
$(BUILD)/libsim.a: $(SIM_O)
	@rm -f $@; ar rcs $@ $^
$(BUILD)/libref.a: $(REF_O)
	@rm -f $@; ar rcs $@ $^
$(BUILD)/libapp.a: $(APP_O)
	@rm -f $@; ar rcs $@ $^
$(BUILD)/dqwatch: $(BUILD)/app/cmd/main.o $(ARCHIVES)
	$(CXX) $(SANFLAGS) $(LDFLAGS) $^ $(SUNLIBS) $(CERESLIBS) -lm -o $@

# C tests see lib/, port_q15/ and sim/; C++ tests see ref/ and app/ as well.
$(call binaries,$(TEST_C)): %: %.o $(BUILD)/tests/unity.o $(BUILD)/libsim.a $(BUILD)/libdqw_q15.a $(BUILD)/libdqw.a
	$(CC) $(SANFLAGS) $^ $(SUNLIBS) -lm -o $@
$(call binaries,$(filter-out %/test_blind.cpp,$(TEST_CXX))): %: %.o $(BUILD)/tests/unity.o $(ARCHIVES)
	$(CXX) $(SANFLAGS) $^ $(SUNLIBS) $(CERESLIBS) -lm -o $@
# What a blind log is, and its judge; its main program apart, for the test.
BLIND_O := $(patsubst %.cpp,$(BUILD)/%.o,$(filter-out bench/blind_main.cpp,$(wildcard bench/blind*.cpp)))
$(BUILD)/tests/test_blind: $(BUILD)/tests/test_blind.o $(BUILD)/tests/unity.o $(BLIND_O) $(ARCHIVES)
$(BUILD)/bench/blind: $(BUILD)/bench/blind_main.o $(BLIND_O) $(ARCHIVES)
$(BUILD)/tests/test_blind $(BUILD)/bench/blind:
	$(CXX) $(SANFLAGS) $^ $(SUNLIBS) $(CERESLIBS) -lm -o $@
$(BUILD)/bench/measured: $(patsubst %.cpp,$(BUILD)/%.o,$(wildcard bench/measured*.cpp)) $(ARCHIVES)
	$(CXX) $(SANFLAGS) $^ $(SUNLIBS) $(CERESLIBS) -lm -o $@
$(BUILD)/docs/site/catalogue $(BUILD)/bench/campaign_reads $(BUILD)/bench/flux_map: %: %.o $(ARCHIVES)
	$(CXX) $(SANFLAGS) $^ $(SUNLIBS) $(CERESLIBS) -lm -o $@
$(C_BENCHES): %: %.o $(BUILD)/libsim.a $(BUILD)/libdqw_q15.a $(BUILD)/libdqw.a
	$(CC) $^ $(SUNLIBS) -lm -o $@

.SECONDARY:
-include $(wildcard $(BUILD)/*/*.d $(BUILD)/*/*/*.d $(USUALDIR)/*/*.d)
