# Sourced by demo.sh and test.sh: makes sure of a C linker and of a Vulkan adapter, or says in one line what
# to install and exits 1. Only Linux needs either from here: macOS draws with Metal, Windows with DirectX 12.

# Whether the loader of Vulkan and the description of at least one driver are there.
clipscape_has_vulkan() {
    PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1' || return 1
    [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] || return 0
    for clipscape_icd in /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json; do
        [ ! -e "$clipscape_icd" ] || return 0
    done
    return 1
}

# clipscape_install WHY PACKAGE...: installs packages with apt-get, or exits with one line.
clipscape_install() {
    clipscape_why=$1
    shift
    clipscape_root=
    if [ "$(id -u)" -ne 0 ]; then
        clipscape_root='sudo -n'
    fi
    if ! command -v apt-get >/dev/null 2>&1 || ! $clipscape_root true 2>/dev/null; then
        echo "clipscape: $clipscape_why; install it first (Debian, Ubuntu: apt-get install $*)" >&2
        exit 1
    fi
    echo "clipscape: $clipscape_why; installing $* with apt-get" >&2
    if ! { $clipscape_root apt-get update -qq &&
        $clipscape_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq --no-install-recommends "$@"; } >/dev/null 2>&1; then
        echo "clipscape: apt-get could not install $*; install it by hand (apt-get install $*)" >&2
        exit 1
    fi
}

if [ "$(uname -s)" = Linux ]; then
    if ! command -v cc >/dev/null 2>&1; then
        clipscape_install 'no C linker, which Rust needs' gcc libc6-dev
    fi
    if ! clipscape_has_vulkan; then
        clipscape_install 'no Vulkan adapter, so frames are drawn in software by lavapipe' \
            mesa-vulkan-drivers libvulkan1
        if ! clipscape_has_vulkan; then
            echo 'clipscape: there is still no Vulkan adapter; see that vulkaninfo finds one' >&2
            exit 1
        fi
    fi
    if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
        XDG_RUNTIME_DIR="${TMPDIR:-/tmp}/clipscape-runtime-$(id -u)"
        mkdir -p -m 700 "$XDG_RUNTIME_DIR"
        export XDG_RUNTIME_DIR
    fi
fi
