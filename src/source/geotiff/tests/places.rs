//! Tests of where images lie.

use super::*;

#[test]
fn area_and_point_name_the_same_samples() {
    let utm = |raster: u16| {
        [
            [1024, 0, 1, 1],
            [1025, 0, 1, raster],
            [3072, 0, 1, 32611],
            [3076, 0, 1, 9001],
        ]
    };
    let data = [1i16, 2, 3, 4, 5, 6];
    let area = encode::<GrayI16>([3, 2], &data, &placed([30.0, 20.0], [1000.0, 5000.0], &utm(1)));
    let point = encode::<GrayI16>([3, 2], &data, &placed([30.0, 20.0], [1015.0, 4990.0], &utm(2)));
    let (a, p) = (read(area).unwrap().0, read(point).unwrap().0);
    let (a_place, p_place) = (a.place.unwrap(), p.place.unwrap());
    assert_eq!((a_place.origin, a_place.pixel), ([1015.0, 4990.0], [30.0, -20.0]));
    assert_eq!((p_place.origin, p_place.pixel), (a_place.origin, a_place.pixel));
    assert_eq!(
        (a_place.registration, p_place.registration),
        (Registration::Area, Registration::Point)
    );
    assert_eq!(
        (a_place.crs.as_deref(), a.grid.spacing_m),
        (Some("EPSG:32611"), [30.0, 20.0])
    );
    // A tie point at another pixel, and a matrix, say the same.
    let mut elsewhere = placed([30.0, 20.0], [0.0; 2], &utm(1));
    elsewhere.tie = Some(vec![2.0, 1.0, 0.0, 1060.0, 4980.0, 0.0]);
    assert_eq!(
        read(encode::<GrayI16>([3, 2], &data, &elsewhere))
            .unwrap()
            .0
            .place,
        Some(a_place.clone())
    );
    let mut matrix = [0.0; 16];
    (matrix[0], matrix[3], matrix[5], matrix[7], matrix[15]) = (30.0, 1000.0, -20.0, 5000.0, 1.0);
    let mut extra = Extra {
        matrix: Some(matrix),
        keys: utm(1).to_vec(),
        ..Extra::default()
    };
    assert_eq!(
        read(encode::<GrayI16>([3, 2], &data, &extra)).unwrap().0.place,
        Some(a_place.clone())
    );
    // Rows from the south: the same samples turned about.
    (matrix[5], matrix[7]) = (20.0, 4960.0);
    extra.matrix = Some(matrix);
    let (d, heights) = read(encode::<GrayI16>([3, 2], &data, &extra)).unwrap();
    assert_eq!(
        (d.place, heights),
        (Some(a_place), vec![4.0, 5.0, 6.0, 1.0, 2.0, 3.0])
    );
}

#[test]
fn units_of_length_and_degrees_become_metres() {
    let spacing = |keys: &[[u16; 4]], scale: f64, at: [f64; 2]| {
        read(encode::<Gray8>([2, 2], &[0; 4], &placed([scale; 2], at, keys)))
            .unwrap()
            .0
    };
    let feet = spacing(
        &[[1024, 0, 1, 1], [3072, 0, 1, 2229], [3076, 0, 1, 9003]],
        100.0,
        [6e6, 2e6],
    );
    assert_eq!(feet.grid.spacing_m, [100.0 * (1200.0 / 3937.0); 2]);
    let degrees = spacing(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]], 0.01, [7.0, 46.01]);
    let place = degrees.place.unwrap();
    assert!(place.geographic && place.crs.as_deref() == Some("EPSG:4326"));
    assert!(
        (degrees.grid.spacing_m[1] - 1111.5).abs() < 0.5,
        "{:?}",
        degrees.grid
    );
    assert!(
        degrees.assumed.iter().any(|s| s.contains("ellipsoid")),
        "{:?}",
        degrees.assumed
    );
    let silent = spacing(&[[1024, 0, 1, 1], [3072, 0, 1, 2229]], 100.0, [6e6, 2e6]);
    assert!(
        silent.assumed.iter().any(|s| s.contains("unit of length")),
        "{:?}",
        silent.assumed
    );
    let unknown = spacing(&[], 0.01, [7.0, 46.0]);
    assert!(unknown.assumed.contains(&geographic::DEGREES_ASSUMED.to_string()));
    let far = spacing(&[], 0.01, [700.0, 46.0]);
    assert_eq!(far.grid.spacing_m, [0.01; 2]);
    assert!(far.assumed.contains(&geographic::METRES_ASSUMED.to_string()));
}
