//! Each target on each of its seeds, once.

use std::fs;

use touchup_fuzz::seeds;
use touchup_fuzz::targets::TARGETS;

#[test]
fn every_target_takes_its_seeds() {
    let folder = tempfile::tempdir().unwrap();
    seeds::write(folder.path()).unwrap();
    for (name, run) in TARGETS {
        let inputs: Vec<_> = fs::read_dir(folder.path().join(name))
            .unwrap_or_else(|error| panic!("{name} has no seeds: {error}"))
            .map(|entry| fs::read(entry.unwrap().path()).unwrap())
            .collect();
        assert!(!inputs.is_empty(), "{name} has no seeds");
        for input in inputs {
            run(&input);
        }
    }
}
