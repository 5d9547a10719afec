# The library alone, and where everything goes. `make lib` needs a C compiler and binutils, nothing else.
# PREFIX, LIBDIR, INCLUDEDIR, BINDIR, DATADIR and DESTDIR are GNU's; EFFECT_WEIGHTS: room for weights of effects.
PREFIX     ?= /usr/local
LIBDIR     ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
BINDIR     ?= $(PREFIX)/bin
DATADIR    ?= $(PREFIX)/share
USUAL_WEIGHTS := $(shell sed -n 's/^.define DQW_EFFECT_WEIGHTS //p' lib/dqw_size.h)
EFFECT_WEIGHTS ?= $(USUAL_WEIGHTS)
VERSION    := $(shell sed -n 's/^.define DQW_VERSION "\(.*\)"/\1/p' lib/dqw_version.h)
SOVERSION  := $(call fact,soversion)
PUBLIC     := $(addprefix lib/,$(call fact,public))
PUBLIC_Q15 := $(addprefix port_q15/,$(call fact,public_q15))
SHARED     := $(BUILD)/shared
SHARED_O   := $(patsubst %.c,$(SHARED)/%.o,$(wildcard lib/*.c))
SHARED_Q15_O := $(patsubst %.c,$(SHARED)/%.o,$(wildcard port_q15/*.c) $(addprefix lib/,$(call fact,shared)))
LIBRARIES  := $(foreach name,libdqwatch libdqwatch_q15,$(BUILD)/$(name).a $(BUILD)/$(name).so.$(VERSION))

## lib          the library alone: static and shared, float and Q15; a C compiler is all it needs. EFFECT_WEIGHTS=N
.PHONY: lib
lib: $(LIBRARIES)

# Objects of both kinds; made anew where a flag has changed.
OWN        := $(call fact,own_flags)
SHARED_CC = $(CC) $(C99) $(LIBWARN) $(OWN) -fPIC -DDQW_EFFECT_WEIGHTS=$(EFFECT_WEIGHTS) -Ilib -Iport_q15 \
            $(CPPFLAGS) $(CFLAGS)
$(SHARED)/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(SHARED_CC) $(LDFLAGS)' | cmp -s - $@ || echo '$(SHARED_CC) $(LDFLAGS)' >$@
.PHONY: FORCE
FORCE:
$(SHARED)/%.o: %.c $(SHARED)/flags
	@mkdir -p $(@D)
	$(SHARED_CC) -c $< -o $@

# What is declared in the public headers themselves; a name may end in the number of weights (DQW_SIZED).
$(SHARED)/libdqwatch.map: $(PUBLIC)
$(SHARED)/libdqwatch_q15.map: $(PUBLIC_Q15) lib/dqw_text.h lib/dqw_effect_name.h
$(SHARED)/%.map: packages/facts.toml lib/dqw_version.h
	@mkdir -p $(@D)
	@{ echo 'DQWATCH_$(SOVERSION) {'; echo '  global:'; \
	    sed -n '/^static/d; s/^[a-z][^(]*[ *]\(dqw_[a-z0-9_]*\)(.*/    \1; \1_w[0-9]*;/p' $(filter %.h,$^); \
	    echo '  local: *;'; echo '};'; } >$@

$(BUILD)/libdqwatch.a $(BUILD)/libdqwatch.so.$(VERSION): $(SHARED_O)
$(BUILD)/libdqwatch_q15.a $(BUILD)/libdqwatch_q15.so.$(VERSION): $(SHARED_Q15_O)
$(BUILD)/libdqwatch.so.$(VERSION): $(SHARED)/libdqwatch.map
$(BUILD)/libdqwatch_q15.so.$(VERSION): $(SHARED)/libdqwatch_q15.map
$(BUILD)/libdqwatch.so.$(VERSION): LIBM := -lm
$(filter %.a,$(LIBRARIES)):
	@rm -f $@; ar rcs $@ $(filter %.o,$^)
$(filter %.so.$(VERSION),$(LIBRARIES)):
	$(CC) -shared -Wl,-soname,$(patsubst %.so.$(VERSION),%.so.$(SOVERSION),$(@F)) -Wl,--version-script=$(filter %.map,$^) \
	    -Wl,-z,defs $(CFLAGS) $(LDFLAGS) $(filter %.o,$^) $(LIBM) -o $@

# What consumers ask: pkg-config and CMake, from one set of values.
FILL = sed -e 's|@VERSION@|$(VERSION)|g; s|@PREFIX@|$(PREFIX)|g; s|@LIBDIR@|$(LIBDIR)|g; s|@INCLUDEDIR@|$(INCLUDEDIR)|g' \
       -e 's|@SUMMARY@|$(call fact,summary)|g; s|@URL@|$(call fact,url)|g; s|@EFFECT_WEIGHTS@|$(EFFECT_WEIGHTS)|g' \
       -e 's|@FLOAT_FLAGS@|$(FP)|g; s|@INCLUDE_FROM_LIBDIR@|$(shell realpath -m --relative-to=$(LIBDIR) $(INCLUDEDIR))/dqwatch|g'
to = $(DESTDIR)$(1)

# Without ldconfig a program does not find what is new in /usr/local/lib; where it may not, PREFIX is the user's own.
## install-lib  headers, libraries, pkg-config and CMake packages of `make lib` to DESTDIR, PREFIX (/usr/local)
.PHONY: install-lib
install-lib: lib
	install -d '$(call to,$(INCLUDEDIR))/dqwatch' '$(call to,$(LIBDIR))/pkgconfig' '$(call to,$(LIBDIR))/cmake/dqwatch'
	install -m 644 $$(printf '#include "%s"\n' $(notdir $(PUBLIC) $(PUBLIC_Q15)) | \
	    $(CC) -std=c99 -DDQW_EFFECT_WEIGHTS=$(EFFECT_WEIGHTS) -Ilib -Iport_q15 -MM -x c - | tr ' \\' '\n\n' | grep '[.]h$$' | sort -u) \
	    '$(call to,$(INCLUDEDIR))/dqwatch'
	install -m 644 $(LIBRARIES) '$(call to,$(LIBDIR))'
	for name in libdqwatch libdqwatch_q15; do \
	    ln -sf $$name.so.$(VERSION) '$(call to,$(LIBDIR))'/$$name.so.$(SOVERSION); \
	    ln -sf $$name.so.$(SOVERSION) '$(call to,$(LIBDIR))'/$$name.so; done
	$(FILL) -e 's|@LIBRARY@|dqwatch|; s|@PRIVATE@|-lm|; s|@FLAGS@| $(FP)|' packages/dqwatch.pc.in >'$(call to,$(LIBDIR))/pkgconfig/dqwatch.pc'
	$(FILL) -e 's|@LIBRARY@|dqwatch_q15|; s|@PRIVATE@||; s|@FLAGS@||' packages/dqwatch.pc.in >'$(call to,$(LIBDIR))/pkgconfig/dqwatch-q15.pc'
	for name in dqwatch-config dqwatch-config-version; do \
	    $(FILL) packages/$$name.cmake.in >'$(call to,$(LIBDIR))'/cmake/dqwatch/$$name.cmake; done
	@[ -n '$(DESTDIR)' ] || ! command -v ldconfig >/dev/null || ldconfig 2>/dev/null || :

## install      the library, the command, its man pages, its completions for bash, zsh and fish
.PHONY: install
install: install-lib $(BUILD)/dqwatch
	install -d '$(call to,$(BINDIR))' '$(call to,$(DATADIR))/man/man1' '$(call to,$(DATADIR))/bash-completion/completions' \
	    '$(call to,$(DATADIR))/zsh/site-functions' '$(call to,$(DATADIR))/fish/vendor_completions.d'
	install -m 755 $(BUILD)/dqwatch '$(call to,$(BINDIR))'
	$(BUILD)/dqwatch --manual '$(call to,$(DATADIR))/man/man1'
	$(BUILD)/dqwatch --completion bash >'$(call to,$(DATADIR))/bash-completion/completions/dqwatch'
	$(BUILD)/dqwatch --completion zsh >'$(call to,$(DATADIR))/zsh/site-functions/_dqwatch'
	$(BUILD)/dqwatch --completion fish >'$(call to,$(DATADIR))/fish/vendor_completions.d/dqwatch.fish'

## uninstall    remove what `make install` with the same DESTDIR and PREFIX has put there
.PHONY: uninstall
uninstall:
	rm -rf '$(call to,$(INCLUDEDIR))/dqwatch' '$(call to,$(LIBDIR))/cmake/dqwatch'
	rm -f '$(call to,$(LIBDIR))'/libdqwatch.a '$(call to,$(LIBDIR))'/libdqwatch_q15.a '$(call to,$(LIBDIR))'/libdqwatch.so* \
	    '$(call to,$(LIBDIR))'/libdqwatch_q15.so* '$(call to,$(LIBDIR))'/pkgconfig/dqwatch.pc '$(call to,$(LIBDIR))'/pkgconfig/dqwatch-q15.pc \
	    '$(call to,$(BINDIR))/dqwatch' '$(call to,$(DATADIR))'/man/man1/dqwatch.1 '$(call to,$(DATADIR))'/man/man1/dqwatch-*.1 \
	    '$(call to,$(DATADIR))/bash-completion/completions/dqwatch' '$(call to,$(DATADIR))/zsh/site-functions/_dqwatch' \
	    '$(call to,$(DATADIR))/fish/vendor_completions.d/dqwatch.fish'

## packages     packages for PlatformIO, Arduino, Zephyr, ESP-IDF, CMSIS, Meson, Conan in build/packages: judged by their tools, and used
.PHONY: packages
packages:
	@.ci/install packages
	@BUILD=$(BUILD) CC="$(CC)" CXX="$(CXX)" tests/packages/all.sh

## packages-full  what needs bare Debian 12 and 13: lib, install and packages from a clean clone; Debian's packages, lintian. As root; long
.PHONY: packages-full
packages-full:
	@BUILD=$(BUILD) tests/packages/full.sh

# The interface as programs in machine code see it, for x86-64, from objects with debug information.
ABI_MAKE = $(MAKE) --no-print-directory BUILD=$(BUILD)/abi OPT=-O0 CFLAGS=-g lib
ABIDW    = abidw --no-corpus-path --no-comp-dir-path --no-show-locs --no-elf-needed --no-parameter-names --exported-interfaces-only
## abi          write packages/abi/*.xml anew, which a test holds the shared library against; where SONAME was released, raise soversion
.PHONY: abi
abi:
	+@$(ABI_MAKE) >/dev/null
	@for name in libdqwatch libdqwatch_q15; do \
	    $(ABIDW) --out-file packages/abi/$$name.xml $(BUILD)/abi/$$name.so.$(VERSION) || exit; done
## abi-test     is the interface that of packages/abi
.PHONY: abi-test
abi-test:
	+@$(ABI_MAKE) >/dev/null
	@for name in libdqwatch libdqwatch_q15; do \
	    abidiff --no-added-syms packages/abi/$$name.xml $(BUILD)/abi/$$name.so.$(VERSION) || exit; done
