#!/bin/sh
# What 16 times the samples cost preprocessing: a DEM of 16384 x 16384 against the sixteen of 4096 x 4096 that it is cut
# into, together and so over the very same ground, and against 16 times the whole of that ground at 4096 x 4096. Printed
# are the seconds of the pyramid, the sun and the sky, their ratios (1 where a sample costs the same), and the most memory
# that each run took beside its ceiling.
#
#   tools/compare_scaling.sh       (DIRECTIONS of the sky, default 16; MEMORY, default 512M)
#
# With FULL=1 a DEM of 32768 x 32768 too, once without light and once with it. The Sierra of ../shared/data, resampled
# by GDAL to whole metres. Needs gdal-bin, GNU time and unzip.
set -eu
cd "$(dirname "$0")/.."
directions=${DIRECTIONS:-16}
memory=${MEMORY:-512M}
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
    sed 's/.*"pyramid_s":\([0-9.e-]*\),.*"sun_s":\([0-9.e-]*\),"sky_s":\([0-9.e-]*\),.*/\1 \2 \3/' stats >> "$log"
    echo "$dem: at most $(($(cat rss) / 1024)) MiB of $memory"
}
resampled 16384
for x in 0 4096 8192 12288; do
    for z in 0 4096 8192 12288; do
        gdal_translate -q -srcwin $x $z 4096 4096 16384.tif part.tif
        run part.tif parts --sky-directions "$directions"
    done
done
run 16384.tif large --sky-directions "$directions"
resampled 4096
run 4096.tif whole --sky-directions "$directions"
ratio() {
    awk -v what="$2" -v times="$3" '
        FNR == NR { p += $1; sun += $2; sky += $3; next }
        function said(name, large, small) { return sprintf("; %s %.2f to %.2f s, %.2f", name, large, small, large / small) }
        { print "16384 against " what said("pyramid", $1, p * times) said("sun", $2, sun * times) said("sky", $3, sky * times) }
    ' "$1" large
}
ratio parts "its sixteen parts together" 1
ratio whole "16 times the whole at 4096" 16
if [ "${FULL:-}" = 1 ]; then
    rm -f 16384.tif
    resampled 32768
    run 32768.tif huge --no-light
    run 32768.tif huge --sky-directions "$directions"
fi
