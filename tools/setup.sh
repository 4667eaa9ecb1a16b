#!/usr/bin/env bash
# Brings .venv up to date: the distribution's packages, the locked PyPI packages, this project. Does only what is
# missing and says what it does; ends at once when nothing changed. `make` calls it before everything else.
#
#   tools/setup.sh        what `make compare` needs
#   tools/setup.sh tests  the tests' browser as well
#   TORCH_INDEX  package index to take torch from, for machines whose default index serves the CUDA build
#   OS_RELEASE   file that names the distribution (default /etc/os-release)
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf 'setup: %s\n' "$*"; }
stop() { printf 'setup: cannot go on: %s\n' "$*" >&2; exit 1; }
elsewhere='Ways on that need neither root nor Debian:
  container  docker build -t pinn-ray . && mkdir -p out &&
             docker run --rm --user "$(id -u)" -v "$PWD/out:/out" pinn-ray
  conda      conda env create -f environment.yml && conda activate pinn-ray,
             then call compare instead of make'

os_release=${OS_RELEASE:-/etc/os-release}
system=$(. "$os_release" 2>/dev/null && echo "${ID:-}${VERSION_ID:-}") || true
apt=requirements/$system.apt lock=requirements/$system.txt dev=requirements/$system-dev.apt # dev: what tests need
if [[ ! -f $apt || ! -f $lock ]]; then
    name=$(. "$os_release" 2>/dev/null && echo "${PRETTY_NAME:-}") || true
    stop "this is ${name:-an unknown system}; DOLFINx is set up on Debian 12 and 13 only.
$elsewhere"
fi

if [[ -e .venv && ! -e .venv/setup-state ]]; then # made by hand, say by pip's way in: it is not ours to change
    stop "the folder .venv was not made by make. Go on with it:
  . .venv/bin/activate && pinnray compare --design default
or let make have its own: mv .venv .venv-other && make"
fi

# Everything that decides what is installed, and where.
state=$(sha256sum tools/setup.sh pyproject.toml "$apt" "$lock" requirements/dev.txt; pwd; echo "${TORCH_INDEX:-}")
up_to_date() { [[ $state == "$(cat .venv/setup-state 2>/dev/null)" ]]; }
SECONDS=0

mapfile -t wanted < <(cat "$apt" ${1:+"$dev"})
missing=()
for package in "${wanted[@]}"; do
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
done
if ((${#missing[@]})); then
    root=()
    if ((EUID)); then
        root=(sudo -n)
        sudo -n true 2>/dev/null || stop "Debian packages are missing and neither root nor sudo without a password is at hand.
Have an administrator run: apt-get install --no-install-recommends ${missing[*]}
$elsewhere"
    fi
    apt_get() { "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 "$@" </dev/null; }
    install() { apt_get install --no-install-recommends -y "${missing[@]}"; }
    say "installing Debian packages: ${missing[*]}"
    if ! install >/dev/null 2>&1; then # as a rule the package lists are absent or old
        say "updating the package lists"
        output=$({ apt_get update && install; } 2>&1) || stop "apt-get could not install ${missing[*]}:
$output"
    fi
fi
up_to_date && exit 0

python=.venv/bin/python
pip() { "$python" -m pip -qq --disable-pip-version-check --no-input "$@"; }
index=(${TORCH_INDEX:+--extra-index-url "$TORCH_INDEX"})
torch=$(grep '^torch==' "$lock") || true # Debian 13 has its own

# uv takes a fifth of pip's time, but reads none of pip's settings, which may name the index of torch's CPU build.
# Neither compiles the packages' 18,000 modules: most are never imported.
install_locked() {
    pip install --no-deps uv==0.13.9 || return
    local by_pip=
    [[ -z $torch ]] || { pip install --no-deps --no-compile "${index[@]}" "$torch" & by_pip=$!; }
    grep -hv '^torch==' "$lock" requirements/dev.txt |
        "$python" -m uv pip install -q --no-deps --python "$python" -r - || return
    [[ -z $by_pip ]] || wait "$by_pip"
}

say "creating .venv on $(/usr/bin/python3 --version), with the distribution's packages in sight"
mkdir -p .venv && touch .venv/setup-state # a setup that is interrupted begins anew
/usr/bin/python3 -m venv --system-site-packages .venv
say "installing the packages of $lock and requirements/dev.txt (about half a minute)"
if ! install_locked; then
    wait
    say "uv could not; by pip alone (two minutes)"
    pip install --no-deps --no-compile "${index[@]}" -r "$lock" -r requirements/dev.txt ||
        stop "pip could not install the locked packages; its own message is above."
fi
say "installing pinn-ray itself"
pip install --no-deps --no-build-isolation -e . || stop "pip could not install this project."

say "starting the libraries, which compiles what they import"
start() { env -u PYTHONDONTWRITEBYTECODE "$python" -c "$1"; }
# An index may serve torch for CUDA only, and the lock leaves out the libraries of that build (several GB).
if ! start 'import torch' 2>/dev/null; then
    say "torch is the CUDA build: installing its libraries (TORCH_INDEX=<PyTorch's CPU index> avoids this)"
    pip install "${index[@]}" "$torch" && start 'import torch' || stop "torch does not start."
fi
start 'import cadquery, cv2, dolfinx, gmsh, matplotlib.pyplot, pandas, pyvista, scipy, sklearn' ||
    stop "a library does not start; its own message is above."

printf '%s\n' "$state" > .venv/setup-state
say "done in $SECONDS s"
