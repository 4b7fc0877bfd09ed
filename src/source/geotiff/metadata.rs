//! Scale, offset and unit of heights from `GDAL_METADATA`, a small XML text.

/// What the text says of a band.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Items {
    /// Heights are `value * scale + offset`.
    pub(super) scale: f64,
    /// See `scale`.
    pub(super) offset: f64,
    /// The unit's name, as written.
    pub(super) unit: Option<String>,
}

/// Reads `<Item name="SCALE" sample="0" role="scale">0.1</Item>` and its like; all else is passed over.
/// Bands are counted from 0.
pub(super) fn read(xml: &str, band: u32) -> Items {
    let sample = band.to_string();
    let mut items = Items {
        scale: 1.0,
        offset: 0.0,
        unit: None,
    };
    for item in xml.split("<Item").skip(1) {
        let Some((attributes, rest)) = item.split_once('>') else {
            continue;
        };
        let Some((value, _)) = rest.split_once("</Item>") else {
            continue;
        };
        let attribute = |key: &str| {
            let (_, after) = attributes.split_once(&format!("{key}=\""))?;
            after.split('"').next()
        };
        if attribute("sample") != Some(sample.as_str()) {
            continue;
        }
        let number = || value.trim().parse::<f64>().ok().filter(|n| n.is_finite());
        match attribute("role") {
            // A scale of 0 would flatten the land; it only ever stands for "not set".
            Some("scale") => items.scale = number().filter(|n| *n != 0.0).unwrap_or(1.0),
            Some("offset") => items.offset = number().unwrap_or(0.0),
            Some("unittype") if !value.trim().is_empty() => items.unit = Some(value.trim().into()),
            _ => {}
        }
    }
    items
}

/// Name and length in metres of a unit that GDAL writes by name.
pub(super) fn linear_unit(name: &str) -> Option<(&'static str, f64)> {
    match name.to_ascii_lowercase().as_str() {
        "m" | "metre" | "meter" | "metres" | "meters" => super::keys::linear_unit(9001),
        "ft" | "foot" | "feet" => super::keys::linear_unit(9002),
        "us survey foot" | "us_survey_foot" | "us-ft" | "sfoot" | "foot_us" => super::keys::linear_unit(9003),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_offset_and_unit_of_a_band_are_found() {
        let xml = "<GDALMetadata>\n <Item name=\"AREA\">x</Item>\n\
                   <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-100</Item>\n\
                   <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.25</Item>\n\
                   <Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\n\
                   <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item>\n</GDALMetadata>";
        assert_eq!(
            read(xml, 0),
            Items {
                scale: 0.25,
                offset: -100.0,
                unit: Some("ft".into())
            }
        );
        assert_eq!((read(xml, 1).scale, read(xml, 1).unit), (7.0, None));
        let none = Items {
            scale: 1.0,
            offset: 0.0,
            unit: None,
        };
        for odd in [
            "",
            "<Item",
            "<Item sample=\"0\" role=\"scale\">",
            "<Item sample=\"0\" role=\"scale\">x</Item>",
        ] {
            assert_eq!(read(odd, 0), none, "{odd}");
        }
        assert_eq!(linear_unit("FT"), Some(("foot", 0.3048)));
        assert_eq!(linear_unit("furlong"), None);
    }
}
