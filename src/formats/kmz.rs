//! KMZ: a ZIP archive with one KML document and its pictures.

use std::io::{Cursor, Read, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::error::{Located, Problem, WriteError};
use super::{MAX_FILE_BYTES, Scenario, write_kml};

/// What a ZIP archive begins with.
pub(super) const MAGIC: &[u8] = b"PK\x03\x04";

/// The most files in an archive; a KMZ with more is no map.
const MAX_ENTRIES: usize = 10_000;

/// The KML document of an archive, and how many further ones there are. A document is never
/// unpacked beyond what a KML file may have, whatever the archive says of its size.
pub(super) fn unpacked(bytes: &[u8]) -> Result<(Vec<u8>, usize), Located> {
    let broken = |error: zip::result::ZipError| Problem::Archive(error.to_string());
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(broken)?;
    if archive.len() > MAX_ENTRIES {
        return Err(Problem::TooMany { what: "files in the archive", limit: MAX_ENTRIES }.into());
    }
    // A name that is no text is none that ends in .kml.
    let names = archive.file_names().filter_map(Result::ok);
    let is_kml = |name: &str| name.to_ascii_lowercase().ends_with(".kml");
    let documents: Vec<String> =
        names.filter(|name| is_kml(name)).map(std::borrow::Cow::into_owned).collect();
    // Google's rule: the first .kml in the archive, which writers call doc.kml.
    let main = documents.iter().find(|name| *name == "doc.kml").or(documents.first());
    let Some(main) = main else {
        return Err(Problem::NotSupported {
            what: "this is a ZIP archive without a KML document".to_owned(),
            advice: "unpack it and give the file with the fences",
        }
        .into());
    };
    let file = archive.by_name(main).map_err(broken)?;
    let mut document = Vec::new();
    file.take(MAX_FILE_BYTES as u64 + 1)
        .read_to_end(&mut document)
        .map_err(|error| Problem::Archive(error.to_string()))?;
    if document.len() > MAX_FILE_BYTES {
        return Err(Problem::TooLarge { bytes: document.len(), limit: MAX_FILE_BYTES }.into());
    }
    Ok((document, documents.len() - 1))
}

/// The scenario as KMZ: its KML, compressed.
///
/// # Errors
/// As [`write_kml`].
pub fn write_kmz(scenario: &Scenario) -> Result<Vec<u8>, WriteError> {
    let failed = |error: String| WriteError::Archive(error);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // A fixed date, the format's first: the same scenario gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    archive.start_file("doc.kml", options).map_err(|error| failed(error.to_string()))?;
    let document = write_kml(scenario)?;
    archive.write_all(document.as_bytes()).map_err(|error| failed(error.to_string()))?;
    let done = archive.finish().map_err(|error| failed(error.to_string()))?;
    Ok(done.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_scenario;

    fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, content) in files {
            archive.start_file(*name, SimpleFileOptions::default()).unwrap();
            archive.write_all(content).unwrap();
        }
        archive.finish().unwrap().into_inner()
    }

    const AREA: &str = "<kml><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>\
        8,47 8.1,47 8.1,47.1 8,47</coordinates></LinearRing></outerBoundaryIs></Polygon>\
        </Placemark></kml>";

    #[test]
    fn the_document_is_found_among_pictures_and_further_ones_are_told() {
        let files: &[(&str, &[u8])] =
            &[("files/a.png", b"x"), ("other.kml", b"<kml/>"), ("doc.kml", AREA.as_bytes())];
        let scenario = read_scenario("area.kmz", &archive(files)).unwrap();
        assert_eq!(scenario.fences.regions.len(), 1);
        assert!(scenario.warnings[0].contains("1 further KML document"), "{:?}", scenario.warnings);
    }

    #[test]
    fn a_document_that_unpacks_to_more_than_a_file_may_have_is_refused() {
        let bomb = archive(&[("doc.kml", &vec![b' '; MAX_FILE_BYTES + 1])]);
        assert!(bomb.len() < MAX_FILE_BYTES / 100);
        let error = read_scenario("bomb.kmz", &bomb).unwrap_err().to_string();
        assert!(error.starts_with("bomb.kmz: 33554433 bytes, more than"), "{error}");
    }

    #[test]
    fn an_archive_that_is_broken_or_holds_no_document_says_so() {
        let error = |bytes: &[u8]| read_scenario("a.kmz", bytes).unwrap_err().to_string();
        assert!(error(b"PK\x03\x04xyz").starts_with("a.kmz: this KMZ cannot be read"));
        assert!(error(&archive(&[("a.txt", b"x")])).contains("without a KML document"));
    }
}
