//! Tests of what is refused, and with which words.

use super::*;

#[test]
fn what_is_no_grid_of_heights_is_unsupported() {
    let gray = |extra: &Extra| encode::<Gray8>([2, 2], &[0; 4], extra);
    let utm = [[1024, 0, 1, 1], [3072, 0, 1, 32611], [3076, 0, 1, 9001]];
    use ErrorKind::{Broken, Unsupported};
    refusal(
        encode::<RGB8>([2, 2], &[0; 12], &Extra::default()),
        Unsupported,
        "3 bands",
    );
    let mut matrix = [0.0; 16];
    (matrix[0], matrix[1], matrix[5]) = (1.0, 0.1, -1.0);
    refusal(
        gray(&Extra {
            matrix: Some(matrix),
            ..Extra::default()
        }),
        Unsupported,
        "rotated",
    );
    let mut points = placed([1.0, 1.0], [0.0; 2], &utm);
    (points.scale, points.tie) = (None, Some(vec![0.0; 12]));
    refusal(gray(&points), Unsupported, "control points");
    let negative = read(gray(&placed([1.0, -1.0], [0.0; 2], &utm))).unwrap().0;
    assert_eq!(negative.place.unwrap().pixel, [1.0, -1.0]);
    assert!(
        negative.assumed[0].contains("scale is negative"),
        "{:?}",
        negative.assumed
    );
    refusal(
        gray(&placed([f64::NAN, 1.0], [0.0; 2], &utm)),
        Unsupported,
        "pixels of NaN",
    );
    refusal(
        gray(&Extra {
            scale: Some([1.0; 3]),
            ..Extra::default()
        }),
        Broken,
        "half of a georeference",
    );
    refusal(
        gray(&placed([1.0; 2], [0.0; 2], &[[1024, 0, 1, 3]])),
        Unsupported,
        "geocentric",
    );
    let grads = [[1024, 0, 1, 2], [2048, 0, 1, 4807], [2054, 0, 1, 9105]];
    refusal(gray(&placed([0.01; 2], [2.0, 48.0], &grads)), Unsupported, "9105");
    let chains = [[1024, 0, 1, 1], [3076, 0, 1, 9033]];
    refusal(gray(&placed([1.0; 2], [0.0; 2], &chains)), Unsupported, "9033");
    refusal(
        gray(&placed([0.01; 2], [7.0, 99.0], &[[1024, 0, 1, 2]])),
        Broken,
        "latitudes",
    );
    for (photometric, part) in [(3, "palette"), (6, "colours as YCbCr")] {
        let mut bytes = gray(&Extra::default());
        let at = bytes
            .windows(8)
            .position(|w| w == [6, 1, 3, 0, 1, 0, 0, 0])
            .unwrap();
        bytes[at + 8] = photometric;
        refusal(bytes, Unsupported, part);
    }
    refusal(tiled(32, 5, &[0; 2048], 2048), Unsupported, "complex");
    refusal(tiled(33, 1, &[0; 2048], 2048), Unsupported, "33 bits");
    refusal(
        tiled(12, 2, &[0; 2048], 2048),
        Unsupported,
        "signed numbers of 12 bits",
    );
}

#[test]
fn damage_is_broken_and_claims_are_limited() {
    let whole = encode::<GrayI16>([40, 40], &[7; 1600], &Extra::default());
    for keep in [3, 7, 9, 60, whole.len() / 2, whole.len() - 1] {
        let error = read(whole[..keep].to_vec()).unwrap_err();
        assert_eq!(
            error.kind(),
            ErrorKind::Broken,
            "{keep} of {} bytes: {error}",
            whole.len()
        );
    }
    let sides = |width: u16, height: u16| {
        let tags = [
            short(256, width),
            short(257, height),
            short(258, 16),
            short(262, 1),
            short(277, 1),
            short(278, height),
        ];
        by_hand(&tags, |start| vec![(273, vec![start]), (279, vec![8])], &[0; 8])
    };
    assert!(read(sides(2, 2)).is_ok());
    refusal(
        sides(2, 3),
        ErrorKind::Broken,
        "ends after 8 of 3 rows of 4 bytes",
    );
    refusal(
        sides(60_000, 60_000),
        ErrorKind::Broken,
        "ends after 8 of 60000 rows",
    );
}
