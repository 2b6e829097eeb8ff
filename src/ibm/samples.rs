//! Real calibration snapshots for tests (`tests/data/ibm_devices.zip`; its README says where from).

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::device::Device;

/// One document of `kyiv` (Eagle), `kingston` (Heron) or `nighthawk`.
pub(super) fn document(name: &str, document: &str) -> String {
    let bytes = include_bytes!("../../tests/data/ibm_devices.zip");
    let mut archive = ZipArchive::new(Cursor::new(bytes.as_slice())).unwrap();
    let mut text = String::new();
    let mut file = archive.by_name(&format!("{name}/{document}.json")).unwrap();
    file.read_to_string(&mut text).unwrap();
    text
}

/// The device.
pub(super) fn device(name: &str) -> Device {
    Device::parse(&document(name, "configuration"), &document(name, "properties")).unwrap()
}
