//! Small valid files of each format, and the broken ones of `data/invalid`.

use std::io::{Cursor, Write};
use std::path::Path;

use clipscape::source::{OpenOptions, RawLayout, SampleType};

/// A format and its files.
pub(crate) struct Format {
    pub(crate) name: &'static str,
    /// Names and bytes of files that are read.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// The same of files that are refused.
    pub(crate) broken: Vec<(String, Vec<u8>)>,
    pub(crate) options: OpenOptions,
    /// What makes a file of damaged bytes: headers that stand beside are put into an archive with their samples.
    pub(crate) pack: fn(Vec<u8>) -> Vec<u8>,
}

fn format(name: &'static str, files: Vec<(&str, Vec<u8>)>, endings: &[&str]) -> Format {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/invalid"));
    let mut broken = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the folder is part of the project") {
        let path = entry.expect("a file").path();
        let file = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if endings.iter().any(|e| file.ends_with(e)) && path.is_file() {
            broken.push((file, std::fs::read(&path).expect("a file")));
        }
    }
    // Rounds are to be the same wherever they run.
    broken.sort();
    Format {
        name,
        files: files.into_iter().map(|(n, b)| (n.to_string(), b)).collect(),
        broken,
        options: OpenOptions::default(),
        pack: |bytes| bytes,
    }
}

pub(crate) fn geotiff() -> Format {
    use tiff::encoder::colortype::{Gray16, Gray32Float, GrayI16};
    use tiff::encoder::{Compression, DeflateLevel, TiffEncoder};
    use tiff::tags::{Predictor, Tag};
    let mut plain = Cursor::new(Vec::new());
    let heights: Vec<i16> = (0..20 * 17).map(|i| (i * i % 991 - 300) as i16).collect();
    let mut encoder = TiffEncoder::new(&mut plain).unwrap();
    let mut image = encoder.new_image::<GrayI16>(20, 17).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[30.0, 30.0, 0.0][..])
        .unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 5e5, 4e6, 0.0][..])
        .unwrap();
    let keys = [1u16, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611];
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
    tags.write_tag(Tag::GdalNodata, "-300").unwrap();
    image.rows_per_strip(5).unwrap();
    image.write_data(&heights).unwrap();
    let packed = |compression, float: bool| {
        let mut out = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new_big(&mut out)
            .unwrap()
            .with_compression(compression);
        if float {
            let heights: Vec<f32> = heights.iter().map(|h| f32::from(*h) / 8.0).collect();
            encoder.write_image::<Gray32Float>(20, 17, &heights).unwrap();
        } else {
            let heights: Vec<u16> = heights.iter().map(|h| h.unsigned_abs()).collect();
            let mut encoder = encoder.with_predictor(Predictor::Horizontal);
            encoder.write_image::<Gray16>(20, 17, &heights).unwrap();
        }
        out.into_inner()
    };
    let files = vec![
        ("lzw.tif", packed(Compression::Lzw, false)),
        (
            "float.tif",
            packed(Compression::Deflate(DeflateLevel::Fast), true),
        ),
        ("packbits.tif", packed(Compression::Packbits, false)),
        ("plain.tif", plain.into_inner()),
    ];
    format("geotiff", files, &[".tif"])
}

pub(crate) fn png() -> Format {
    let encode = |depth: png::BitDepth| {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 23, 11);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        let bytes = 23 * 11 * if depth == png::BitDepth::Sixteen { 2 } else { 1 };
        let pixels: Vec<u8> = (0..bytes as u32).map(|i| (i * i % 251) as u8).collect();
        writer.write_image_data(&pixels).unwrap();
        writer.finish().unwrap();
        out
    };
    let files = vec![
        ("a.png", encode(png::BitDepth::Sixteen)),
        ("b.png", encode(png::BitDepth::Eight)),
    ];
    Format {
        pack: mend_checksums,
        ..format("png", files, &[".png"])
    }
}

/// Damage behind a wrong checksum would not be looked at: half of the damaged pictures get right ones.
fn mend_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    if bytes.len() % 2 == 1 {
        return bytes;
    }
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(chunk) = bytes.get(at + 4..at.saturating_add(8).saturating_add(length)) else {
            break;
        };
        let mut crc = flate2::Crc::new();
        crc.update(chunk);
        let end = at + 8 + length;
        if let Some(sum) = bytes.get_mut(end..end + 4) {
            sum.copy_from_slice(&crc.sum().to_be_bytes());
        }
        at = end + 4;
    }
    bytes
}

pub(crate) fn openexr() -> Format {
    use exr::prelude::*;
    let encode = |compression, blocks, half: bool| {
        let ramp: Vec<f32> = (0..21 * 13).map(|i| (i * i % 97) as f32).collect();
        let samples = if half {
            FlatSamples::F16(ramp.iter().map(|v| f16::from_f32(*v)).collect())
        } else {
            FlatSamples::F32(ramp)
        };
        let channels = AnyChannels::sort(vec![AnyChannel::new("Y", samples)].into());
        let encoding = Encoding {
            compression,
            blocks,
            line_order: LineOrder::Increasing,
        };
        let layer = Layer::new((21, 13), LayerAttributes::named("main"), encoding, channels);
        let mut out = Cursor::new(Vec::new());
        Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut out)
            .unwrap();
        out.into_inner()
    };
    let files = vec![
        (
            "a.exr",
            encode(Compression::ZIP16, Blocks::Tiles(Vec2(8, 8)), false),
        ),
        ("b.exr", encode(Compression::PIZ, Blocks::ScanLines, false)),
        ("c.exr", encode(Compression::RLE, Blocks::ScanLines, true)),
        ("d.exr", encode(Compression::PXR24, Blocks::ScanLines, false)),
        (
            "e.exr",
            encode(Compression::Uncompressed, Blocks::Tiles(Vec2(4, 8)), true),
        ),
    ];
    format("openexr", files, &[".exr"])
}

/// A tile has no header and one of three lengths: it comes packed.
pub(crate) fn hgt() -> Format {
    let tile = vec![0u8; 2 * 1201 * 1201];
    format(
        "hgt",
        vec![("N00E000.hgt.zip", zipped(&[("N00E000.hgt", &tile)], true))],
        &[".hgt", ".hgt.zip"],
    )
}

pub(crate) fn dted() -> Format {
    let (width, height) = (5u16, 7u16);
    let mut bytes = format!("UHL10800000W0430000N03000300{:19}{width:04}{height:04}", "").into_bytes();
    for (text, length) in [("", 80), ("DSI", 728), ("ACC", 3428)] {
        bytes.extend(text.bytes());
        bytes.resize(length, b' ');
    }
    for x in 0..width {
        let start = bytes.len();
        bytes.extend([0xaa, 0, 0, x as u8, 0, x as u8, 0, 0]);
        bytes.extend((0..height).flat_map(|z| (100 * x + z).to_be_bytes()));
        let sum: u32 = bytes[start..].iter().map(|b| u32::from(*b)).sum();
        bytes.extend(sum.to_be_bytes());
    }
    format("dted", vec![("a.dt0", bytes)], &[".dt0"])
}

pub(crate) fn usgs_dem() -> Format {
    // The broken one is whole as far as its first profile.
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/invalid"));
    let cut = std::fs::read(folder.join("dem-profiles-missing.dem")).expect("a file");
    let mut utm = cut[..2048].to_vec();
    for k in 2..=3 {
        let mut profile = cut[1024..2048].to_vec();
        profile[6..12].copy_from_slice(format!("{k:6}").as_bytes());
        utm.extend(profile);
    }
    let mut degrees = utm.clone();
    degrees[156..162].copy_from_slice(b"     0");
    degrees[528..534].copy_from_slice(b"     3");
    format("usgs_dem", vec![("a.dem", utm), ("b.dem", degrees)], &[".dem"])
}

const GRID: &str = "ncols 3\nnrows 2\nxllcorner 7.5\nyllcorner 46\ncellsize 0.01\nNODATA_value -9999\n\
                    1 2.5 -9999\n4e2 5 -6,5\n";

pub(crate) fn ascii_grid() -> Format {
    let centre = GRID
        .replace("corner", "center")
        .replace("cellsize 0.01", "dx 30\ndy 20")
        .replace(' ', "\r\n");
    format(
        "ascii_grid",
        vec![("a.asc", GRID.into()), ("b.asc", centre.into_bytes())],
        &[".asc"],
    )
}

/// A file whose first 512 bytes are its header, which stands beside it.
fn with_header(text: &str, samples: &[u8]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(512, b' ');
    bytes.extend(samples);
    bytes
}

fn pack_with_header(bytes: Vec<u8>) -> Vec<u8> {
    let (header, samples) = bytes.split_at(bytes.len().min(512));
    zipped(&[("a.hdr", header), ("a.bil", samples)], false)
}

pub(crate) fn bil() -> Format {
    let header = "NROWS 4\nNCOLS 5\nNBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER M\nLAYOUT BIL\nSKIPBYTES 2\nNBANDS 1\n\
                  BANDROWBYTES 10\nTOTALROWBYTES 12\nULXMAP 7\nULYMAP 46\nXDIM 0.01\nYDIM 0.01\nNODATA -9999\n";
    let float = "ncols 3\nnrows 3\ncellsize 30\nxllcorner 5e5\nyllcorner 4e6\nnodata_value -9999\nnbits 64\n\
                 pixeltype float\nbyteorder lsbfirst\nlayout bip\n";
    let doubles: Vec<u8> = (0..9)
        .flat_map(|i| (f64::from(i) * 1e7 + 0.1).to_le_bytes())
        .collect();
    let files = vec![
        ("a.zip", with_header(header, &[1; 50])),
        ("b.zip", with_header(float, &doubles)),
    ];
    Format {
        pack: pack_with_header,
        ..format("bil", files, &[])
    }
}

pub(crate) fn envi() -> Format {
    let header = "ENVI\nsamples = 5\nlines = 4\nbands = 1\nheader offset = 2\ndata type = 4\ninterleave = bsq\n\
                  byte order = 0\ndata ignore value = 0\nmap info = {UTM, 1, 1, 440720, 3751320, 60, 60, 11, North, \
                  units=Meters}\ncoordinate system string = {PROJCS[\"a\",UNIT[\"Meter\",1.0]]}\n";
    let files = vec![("a.zip", with_header(header, &[1; 82]))];
    Format {
        pack: pack_with_header,
        ..format("envi", files, &[])
    }
}

pub(crate) fn raw() -> Format {
    let options = OpenOptions {
        raw: Some(RawLayout {
            width: 6,
            height: 4,
            sample: SampleType::F64,
            big_endian: false,
        }),
        ..OpenOptions::default()
    };
    let bytes: Vec<u8> = (0..24)
        .flat_map(|i| (f64::from(i) * 1.1e7).to_le_bytes())
        .collect();
    Format {
        options,
        ..format("raw", vec![("a.raw", bytes)], &[])
    }
}

pub(crate) fn zip() -> Format {
    let samples = vec![9u8; 4 * 3000];
    let header = "NROWS 30\nNCOLS 100\nNBITS 32\nPIXELTYPE FLOAT\nBYTEORDER I\n";
    let files = vec![
        (
            "a.zip",
            zipped(&[("a.asc", GRID.as_bytes()), ("readme.txt", b"text")], true),
        ),
        (
            "b.zip",
            zipped(&[("b/a.bil", &samples), ("b/a.hdr", header.as_bytes())], true),
        ),
        ("c.zip", zipped(&[("a.asc", GRID.as_bytes())], false)),
    ];
    format("zip", files, &[".zip"])
}

pub(crate) fn gzip() -> Format {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    writer.write_all(GRID.as_bytes()).unwrap();
    format("gzip", vec![("a.asc.gz", writer.finish().unwrap())], &[".gz"])
}

fn zipped(files: &[(&str, &[u8])], deflated: bool) -> Vec<u8> {
    use zip::CompressionMethod::{Deflated, Stored};
    let method = if deflated { Deflated } else { Stored };
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, data) in files {
        writer.start_file(*name, options).unwrap();
        writer.write_all(data).unwrap();
    }
    writer.finish().unwrap().into_inner()
}
