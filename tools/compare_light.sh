#!/bin/sh
# The sun's share with shadows beside SAGA's ta_lighting and GRASS's r.sun, of the same heights in the same run: a sun 3
# degrees high, in turns, medians and ratios.
#
#   tools/compare_light.sh [ROUNDS]
#
# Crops of the Sierra of ../shared/data, 4096 x 4096 for SAGA and 2048 x 2048 for GRASS, placed on a grid of 92 m. Ours is
# the wall time of a preprocess with --sky-directions 0 less that of one with --no-light, and sun_s alone; theirs is what
# they need with the grid at hand: SAGA's command, GRASS's module within a session. Needs gdal-bin, saga, grass-core, GNU
# time and unzip.
set -eu
cd "$(dirname "$0")/.."
rounds=${1:-3}
cargo build --release --quiet --no-default-features --features dem,cli
own=$PWD/target/release/clipscape
sierra=$PWD/../shared/data/sierra
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for zip in "$sierra"/*.zip; do unzip -qo "$zip" -d hgt; done
gdalbuildvrt -q sierra.vrt hgt/*.hgt
crop() {
    gdal_translate -q -srcwin 2000 300 "$1" "$1" -a_srs EPSG:32611 \
        -a_ullr 300000 $((4000000 + 92 * $1)) $((300000 + 92 * $1)) 4000000 sierra.vrt "$1.tif"
}
crop 4096
crop 2048
gdal_translate -q -of SAGA 4096.tif 4096.sdat
grass -c 2048.tif -e grassdata > grass.log 2>&1
cat > r.sh <<'SH'
r.in.gdal --quiet --overwrite input=2048.tif output=elevation
g.region raster=elevation
r.slope.aspect --quiet --overwrite elevation=elevation slope=slope aspect=aspect
# The hour at which the sun stands 3 degrees high over the crop's middle on the 172nd day.
for _ in $(seq "$1"); do
    /usr/bin/time -a -o grass.s -f %e r.sun --quiet --overwrite nprocs=2 elevation=elevation slope=slope aspect=aspect \
        day=172 time=5.1 incidout=incidence
done
SH
median() { sort -n "$1" | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
timed() {
    log=$1
    shift
    /usr/bin/time -a -o "$log" -f %e "$@" > run.log 2>&1 || { cat run.log; exit 1; }
}
for _ in $(seq "$rounds"); do
    timed saga.s saga_cmd -f=q -c=2 ta_lighting 0 -ELEVATION=4096.sgrd -SHADE=shade.sgrd -METHOD=2 -AZIMUTH=135 \
        -DECLINATION=3 -UNIT=1
    grass grassdata/PERMANENT --exec sh r.sh 1 >> grass.log 2>&1
    for side in 4096 2048; do
        timed none$side.s "$own" preprocess $side.tif --no-light -q -f -o a.terrain.exr
        timed sun$side.s "$own" preprocess $side.tif --sun 135,3 --sky-directions 0 -q -f -o a.terrain.exr --stats stats
        sed 's/.*"sun_s":\([0-9.e-]*\).*/\1/' stats >> alone$side.s
    done
done
ratio() {
    theirs=$(median "$1")
    none=$(median none"$3".s)
    sun=$(median sun"$3".s)
    alone=$(median alone"$3".s)
    echo "$theirs $none $sun $alone" | awk -v who="$2" -v side="$3" '{
        printf "%s, %d x %d: %.2f s; ours with light less without: %.2f - %.2f = %.2f s, %.1f times as fast; ", \
            who, side, side, $1, $3, $2, $3 - $2, $1 / ($3 - $2)
        printf "sun_s alone: %.3f s, %.1f times\n", $4, $1 / $4
    }'
}
ratio saga.s "SAGA ta_lighting" 4096
ratio grass.s "GRASS r.sun" 2048
