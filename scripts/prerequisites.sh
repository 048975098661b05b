#!/bin/sh
# Checks that what the Makefile cannot install by itself is there: a Rust toolchain, and Python with venv.
# Usage: prerequisites.sh PYTHON
set -u
python=$1
missing=0

complain() {
    echo "error: $1" >&2
    echo "hint: $2" >&2
    missing=1
}

get_rust="install it from https://rustup.rs (no root needed): curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
if ! command -v cargo >/dev/null || ! command -v rustc >/dev/null; then
    complain "no Rust toolchain (cargo, rustc) is found; 1.85 or newer is needed" "$get_rust"
else
    version=$(rustc --version | cut -d' ' -f2)
    major=${version%%.*}
    minor=${version#*.}
    minor=${minor%%.*}
    if [ "$major" -lt 1 ] || { [ "$major" -eq 1 ] && [ "$minor" -lt 85 ]; }; then
        complain "Rust $version is too old; 1.85 or newer is needed" "run: rustup update stable; or $get_rust"
    fi
fi
if ! command -v cc >/dev/null && ! command -v gcc >/dev/null && ! command -v clang >/dev/null; then
    complain "no linker (cc) is found, which Rust needs" \
        "install a C compiler: 'apt install gcc', 'dnf install gcc', or 'xcode-select --install'"
fi

if ! command -v "$python" >/dev/null; then
    complain "$python is not found; Python 3.10 or newer is needed" \
        "install it from https://www.python.org or your system's packages, or name one: make PYTHON=python3.12"
elif ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))'; then
    complain "$("$python" --version) is too old; 3.10 or newer is needed" \
        "install a newer one and name it: make PYTHON=python3.12"
elif ! "$python" -c 'import venv, ensurepip' 2>/dev/null; then
    complain "this Python has no module venv" \
        "install it ('apt install python3-venv'), or name another Python: make PYTHON=python3.12"
fi
exit $missing
