//! The fuzz targets over their corpora: what was found once is not lost again, and the targets
//! themselves stay sound. `make fuzz` goes on from there.

use std::path::Path;

#[path = "../fuzz/src/targets/mod.rs"]
mod targets;

#[test]
fn every_input_of_the_corpora_is_survived() {
    for (name, target) in targets::ALL {
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(name);
        let mut inputs = 0;
        for entry in std::fs::read_dir(&corpus).unwrap() {
            target(&std::fs::read(entry.unwrap().path()).unwrap());
            inputs += 1;
        }
        assert!(inputs >= 5, "{name}: {inputs} inputs");
        // And nothing at all, and too little.
        for length in 0..40 {
            target(&vec![0xfd; length]);
        }
    }
}
