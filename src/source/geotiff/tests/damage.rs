//! Damage to every byte of small files of every kind: an error or heights, never a panic, nor memory on a file's word.

use super::writer::{Image, write};
use super::*;

/// Files of every compression, kind of block and header, small enough to damage each byte of them in turn.
fn files() -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    for (i, compression) in [1, 5, 8, 32773, 50000].into_iter().enumerate() {
        let mut image = Image::new(13, 11, 2, 16);
        image.compression = compression;
        image.predictor = if matches!(compression, 5 | 8 | 50000) {
            2
        } else {
            1
        };
        image.block = if i % 2 == 0 { [0, 4] } else { [16, 16] };
        image.tags.push((33550, 12, vec![30.0, 30.0, 0.0]));
        image
            .tags
            .push((33922, 12, vec![0.0, 0.0, 0.0, 600.0, 900.0, 0.0]));
        image.tags.push((
            34735,
            3,
            vec![
                1.0, 1.0, 0.0, 2.0, 1024.0, 0.0, 1.0, 1.0, 3072.0, 0.0, 1.0, 32611.0,
            ],
        ));
        files.push(write(&[image.clone().text(42113, "-9999")], i % 2 == 1, i > 2));
        let mut mask = Image::new(13, 11, 1, 1);
        mask.tags.push((254, 4, vec![4.0]));
        let mut half = Image::new(7, 6, 2, 16);
        half.tags.push((254, 4, vec![1.0]));
        files.push(write(&[image, mask, half], false, false));
    }
    let mut floats = Image::new(13, 11, 3, 32);
    (floats.compression, floats.predictor, floats.bands) = (8, 3, 2);
    files.push(write(&[floats], true, false));
    files
}

/// Opens a file and reads its corners and overviews.
fn look(bytes: Vec<u8>) {
    let bytes: Arc<dyn ReadAt> = Arc::new(bytes);
    let options = OpenOptions {
        band: Some(crate::source::Band::Number(1)),
        ..OpenOptions::default()
    };
    let Ok(source) = open("t.tif", bytes, &options) else {
        return;
    };
    let corners = |source: &dyn HeightSource| {
        let size = source.description().grid.size;
        let (width, height) = (size.width.min(40), size.height.min(40));
        for (x, z) in [(0, 0), (size.width - width, size.height - height)] {
            let mut out = vec![0.0; (width * height) as usize];
            let _ = source.read(Rect::new(x, z, x + width, z + height), &mut out);
        }
    };
    corners(&source);
    if let Ok(overviews) = source.overviews() {
        overviews.iter().for_each(|o| corners(o.source.as_ref()));
    }
}

#[test]
fn every_byte_may_be_wrong_and_every_end_too_early() {
    for file in files() {
        for at in 0..file.len() {
            for value in [0, 1, 0x7f, 0xff, file[at] ^ 0x10, file[at].wrapping_add(1)] {
                let mut bytes = file.clone();
                bytes[at] = value;
                look(bytes);
            }
            look(file[..at].to_vec());
        }
    }
}

#[test]
fn random_damage_to_several_bytes() {
    let seed = 20_261_125;
    let mut random = crate::pyramid::random::Random::new(seed);
    let files = files();
    for _ in 0..3000 {
        let mut bytes = files[random.below(files.len() as i64) as usize].clone();
        for _ in 0..=random.below(8) {
            let at = random.below(bytes.len() as i64) as usize;
            bytes[at] = random.below(256) as u8;
        }
        look(bytes);
    }
}
