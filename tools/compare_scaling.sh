#!/bin/sh
# What 16 times the samples cost preprocessing: a DEM of 16384 x 16384 against the sixteen of 4096 x 4096 that it is cut
# into, on average and so over the very same ground, and against the whole of that ground at 4096 x 4096. Printed are the
# seconds of all but tracing light, of light, of the sun and of the sky, how many times as long the large one takes, and
# the most memory that each run took beside its ceiling.
#
#   tools/compare_scaling.sh       (DIRECTIONS of the sky, default 16; MEMORY, default 512M; SIDE, default 16384)
#
# With FULL=1 a DEM of twice the side too, once without light and once with it. The Sierra of ../shared/data, resampled
# by GDAL to whole metres. Needs gdal-bin, GNU time and unzip.
set -eu
cd "$(dirname "$0")/.."
directions=${DIRECTIONS:-16}
memory=${MEMORY:-512M}
side=${SIDE:-16384}
part=$((side / 4))
cargo build --release --quiet --no-default-features --features dem,cli
own=$PWD/target/release/clipscape
sierra=$PWD/../shared/data/sierra
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for zip in "$sierra"/*.zip; do unzip -qo "$zip" -d hgt; done
gdalbuildvrt -q sierra.vrt hgt/*.hgt
resampled() {
    gdal_translate -q -ot Int16 -outsize "$1" "$1" -r bilinear -co COMPRESS=DEFLATE -co TILED=YES -co BIGTIFF=YES \
        sierra.vrt "$1.tif"
}
# Runs the rest over a DEM and adds its times to a file; what it took at most is printed.
run() {
    dem=$1
    log=$2
    shift 2
    /usr/bin/time -o rss -f %M "$own" preprocess "$dem" -q -f --memory "$memory" -o a.terrain.exr --stats stats "$@"
    sed 's/.*"sun_s":\([0-9.e-]*\),"sky_s":\([0-9.e-]*\),.*"total_s":\([0-9.e-]*\),.*/\1 \2 \3/' stats >> "$log"
    echo "$dem: at most $(($(cat rss) / 1024)) MiB of $memory"
}
resampled "$side"
for k in 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do
    gdal_translate -q -srcwin $((k % 4 * part)) $((k / 4 * part)) $part $part "$side.tif" part.tif
    run part.tif parts --sky-directions "$directions"
done
run "$side.tif" large --sky-directions "$directions"
resampled "$part"
run "$part.tif" whole --sky-directions "$directions"
ratio() {
    awk -v what="$2" -v side="$side" '
        FNR == NR { runs++; sun += $1; sky += $2; rest += $3 - $1 - $2; next }
        function said(name, large, small) {
            return sprintf("; %s %.2f and %.2f s, %.1f times", name, large, small / runs, large * runs / small)
        }
        {
            print side " x " side " and " what said("all but tracing light", $3 - $1 - $2, rest) \
                said("light", $1 + $2, sun + sky) said("sun", $1, sun) said("sky", $2, sky)
        }
    ' "$1" large
}
ratio parts "one of its sixteen parts"
ratio whole "the whole at $part x $part"
if [ "${FULL:-}" = 1 ]; then
    rm -f "$side.tif"
    resampled $((2 * side))
    run $((2 * side)).tif huge --no-light
    run $((2 * side)).tif huge --sky-directions "$directions"
fi
