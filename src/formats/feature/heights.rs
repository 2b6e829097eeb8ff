//! How high an obstacle reaches, from and to the properties of its feature.
//!
//! Maps are made by others: a height that cannot be used is no reason not to read the obstacle. It
//! then counts at all altitudes, and a warning says so.

use serde_json::{Map, Value, json};

use super::Feature;
use crate::fence::{HeightRange, HeightReference};
use crate::formats::item::json_number;
use crate::units::Metres;

/// Heights that are given but mean nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Unusable;

/// The heights that the properties give; `None` where they give none.
pub(super) fn heights(feature: &Feature) -> Result<Option<HeightRange>, Unusable> {
    let length = |key: &str| match feature.properties.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(value) => metres(value).map(Some).ok_or(Unusable),
    };
    let (height, max, bottom) = (length("height")?, length("max_height")?, length("min_height")?);
    let top = match (height, max) {
        (Some(height), Some(max)) => Some(height.max(max)),
        (height, max) => height.or(max),
    };
    let reference = match feature.properties.get("height_reference").map(Value::as_str) {
        None | Some(Some("ground")) => HeightReference::Ground,
        Some(Some("amsl")) => HeightReference::MeanSeaLevel,
        _ => return Err(Unusable),
    };
    if top.is_none() && bottom.is_none() {
        return Ok(None);
    }
    let upside_down = matches!((bottom, top), (Some(bottom), Some(top)) if bottom.0 >= top.0);
    let below_ground = reference == HeightReference::Ground
        && [bottom, top].into_iter().flatten().any(|end| end.0 < 0.0);
    // A building of no height is one whose height nobody knew.
    let flat = reference == HeightReference::Ground && top.is_some_and(|top| top.0 <= 0.0);
    if upside_down || below_ground || flat {
        return Err(Unusable);
    }
    Ok(Some(HeightRange { reference, bottom, top }))
}

/// A number, or text of one with or without its unit (`12`, `12.5 m`), as OpenStreetMap has it.
fn metres(value: &Value) -> Option<Metres> {
    let number = match value {
        Value::String(text) => {
            let text = text.trim();
            text.strip_suffix('m').unwrap_or(text).trim_end().parse().ok()?
        }
        other => other.as_f64()?,
    };
    f64::is_finite(number).then_some(Metres(number))
}

/// The reverse.
pub(super) fn height_properties(heights: Option<HeightRange>) -> Map<String, Value> {
    let mut properties = Map::new();
    let Some(HeightRange { reference, bottom, top }) = heights else { return properties };
    for (key, end) in [("height", top), ("min_height", bottom)] {
        if let Some(end) = end {
            properties.insert(key.to_owned(), json_number(end.0));
        }
    }
    let reference = match reference {
        HeightReference::Ground => "ground",
        HeightReference::MeanSeaLevel => "amsl",
    };
    properties.insert("height_reference".to_owned(), json!(reference));
    properties
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(properties: Value) -> Result<Option<HeightRange>, Unusable> {
        let Value::Object(properties) = properties else { panic!("an object") };
        heights(&Feature::named("feature", 1, properties, None))
    }

    fn ground(bottom: Option<f64>, top: Option<f64>) -> HeightRange {
        let reference = HeightReference::Ground;
        HeightRange { reference, bottom: bottom.map(Metres), top: top.map(Metres) }
    }

    #[test]
    fn heights_are_read_as_maps_have_them() {
        assert_eq!(read(json!({})), Ok(None));
        assert_eq!(read(json!({ "height": 12 })), Ok(Some(ground(None, Some(12.0)))));
        assert_eq!(read(json!({ "height": "12.5 m" })), Ok(Some(ground(None, Some(12.5)))));
        assert_eq!(
            read(json!({ "height": null, "max_height": "9" })),
            Ok(Some(ground(None, Some(9.0))))
        );
        let both = json!({ "height": 12, "max_height": 30, "min_height": 4 });
        assert_eq!(read(both), Ok(Some(ground(Some(4.0), Some(30.0)))));
        assert_eq!(read(json!({ "min_height": 40 })), Ok(Some(ground(Some(40.0), None))));
        let chart = read(json!({ "height": 500, "height_reference": "amsl" })).unwrap().unwrap();
        assert_eq!(chart.reference, HeightReference::MeanSeaLevel);
    }

    #[test]
    fn heights_that_mean_nothing_are_said_to() {
        for odd in [
            json!({ "height": "tall" }),
            json!({ "height": [12] }),
            json!({ "height": 0 }),
            json!({ "height": -3 }),
            json!({ "height": 5, "min_height": 5 }),
            json!({ "height": 5, "height_reference": "roof" }),
            json!({ "height": "40 ft" }),
        ] {
            assert_eq!(read(odd.clone()), Err(Unusable), "{odd}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            bottom in prop::option::of(0.0..100.0_f64), above in prop::option::of(0.1..400.0_f64),
            amsl in any::<bool>(),
        ) {
            prop_assume!(bottom.is_some() || above.is_some());
            let top = above.map(|above| Metres(bottom.unwrap_or(0.0) + above));
            let reference =
                if amsl { HeightReference::MeanSeaLevel } else { HeightReference::Ground };
            let range = HeightRange { reference, bottom: bottom.map(Metres), top };
            prop_assert_eq!(read(Value::Object(height_properties(Some(range)))), Ok(Some(range)));
        }
    }
}
