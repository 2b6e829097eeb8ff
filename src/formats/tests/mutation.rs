//! Broken files: whatever is done to a valid one, the readers answer, and never panic.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::{
    examples, parse, read_fences, read_mission, read_scenario, regions, text_of, write_geojson,
    write_kml, write_plan,
};

/// The examples that are small enough to read some thousand times.
static FILES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let files = examples().into_iter().map(|file| std::fs::read(file).unwrap());
    files.filter(|bytes| bytes.len() < 30_000).collect()
});

#[derive(Debug, Clone)]
enum Change {
    /// Cut the file off.
    Truncate(prop::sample::Index),
    /// Replace one byte.
    Byte(prop::sample::Index, u8),
    /// Take out a stretch.
    Remove(prop::sample::Index, u8),
    /// Put a stretch in twice.
    Repeat(prop::sample::Index, u8),
    /// Put a text in the place of a word.
    Word(prop::sample::Index, &'static str),
    /// Put a number in the place of the next number.
    Number(prop::sample::Index, &'static str),
}

fn change() -> impl Strategy<Value = Change> {
    const WORDS: [&str; 22] = [
        "",
        "null",
        "-0",
        "1e308",
        "-1e40",
        "1e-320",
        "NaN",
        "inf",
        "65535",
        "65536",
        "4294967296",
        "3.5",
        "[]",
        "[[[]]]",
        "{}",
        "\"x\"",
        "<a>",
        "</Polygon>",
        "<Polygon/>",
        "<![CDATA[1,2]]>",
        "&amp;",
        "\u{0}",
    ];
    const NUMBERS: [&str; 14] = [
        "0", "-1", "1", "2", "3", "4", "16", "177", "5001", "5004", "5100", "90.5", "65536",
        "-1e39",
    ];
    let index = any::<prop::sample::Index>;
    let number = prop::sample::select(&NUMBERS[..]);
    prop_oneof![
        1 => index().prop_map(Change::Truncate),
        4 => (index(), 32..127u8).prop_map(|(at, byte)| Change::Byte(at, byte)),
        2 => (index(), any::<u8>()).prop_map(|(at, length)| Change::Remove(at, length)),
        2 => (index(), any::<u8>()).prop_map(|(at, length)| Change::Repeat(at, length)),
        20 => (index(), number).prop_map(|(at, number)| Change::Number(at, number)),
        6 => (index(), prop::sample::select(&WORDS[..])).prop_map(|(at, word)| Change::Word(at, word)),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    match *change {
        Change::Truncate(at) => bytes.truncate(at.index(bytes.len())),
        Change::Byte(at, byte) => {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        Change::Remove(at, length) => {
            let at = at.index(bytes.len());
            bytes.drain(at..bytes.len().min(at + usize::from(length)));
        }
        Change::Repeat(at, length) => {
            let at = at.index(bytes.len());
            let part = bytes[at..bytes.len().min(at + usize::from(length))].to_vec();
            bytes.splice(at..at, part);
        }
        Change::Word(at, word) => replace_word(bytes, at.index(bytes.len()), word),
        Change::Number(at, number) => {
            let at = at.index(bytes.len());
            let next = bytes[at..].iter().position(u8::is_ascii_digit);
            replace_word(bytes, at + next.unwrap_or(0), number);
        }
    }
}

fn replace_word(bytes: &mut Vec<u8>, at: usize, word: &str) {
    let part_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
    let end = at + bytes[at..].iter().take_while(|byte| part_of_word(byte)).count();
    let before = bytes[..at].iter().rev().take_while(|byte| part_of_word(byte)).count();
    bytes.splice(at - before..end, word.bytes());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_damaged_file_is_read_or_refused(
        file in any::<prop::sample::Index>(),
        changes in prop::collection::vec(change(), 1..4),
    ) {
        let mut bytes = FILES[file.index(FILES.len())].clone();
        changes.iter().for_each(|change| apply(&mut bytes, change));
        match read_scenario("file", &bytes) {
            Ok(scenario) => {
                // What was let in is sound.
                for (index, item) in scenario.mission.items.iter().enumerate() {
                    prop_assert_eq!(usize::from(item.seq), index);
                    prop_assert!(item.params.iter().all(|param| !param.is_infinite()));
                }
                // And what can be written reads back.
                for text in [write_plan, write_geojson, write_kml].map(|write| write(&scenario)) {
                    let Ok(text) = text else { continue };
                    let again = parse(&text);
                    prop_assert_eq!(text_of(&again.mission), text_of(&scenario.mission));
                    prop_assert_eq!(regions(&again.fences), regions(&scenario.fences));
                    prop_assert_eq!(again.fences.return_point, scenario.fences.return_point);
                }
            }
            Err(error) => prop_assert!(error.to_string().starts_with("file")),
        }
        let _ = read_fences("file", &bytes);
        let _ = read_mission("file", &bytes);
    }

    #[test]
    fn any_bytes_at_all_are_read_or_refused(
        start in prop::sample::select(vec!["", "QGC WPL 110\n", "{\"type\":", "<kml>", "1 2\n"]),
        rest in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let bytes = [start.as_bytes(), &rest].concat();
        let _ = read_scenario("file", &bytes);
    }
}
