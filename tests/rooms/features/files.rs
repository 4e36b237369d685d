//! Files of touches and of features: a round trip is exact, and errors name the damage.

use std::fs;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use touchup::features::{Feature, FeatureKind, detect};
use touchup::io::features_file::{FeatureFile, FeaturesFileError, read_features, write_features};
use touchup::io::file_error::FileError;
use touchup::io::result_table::{ResultTable, write_features_as_named, write_touches_as_named};
use touchup::io::touches_file::{
    HEADER, TouchesFileError, as_written, read_touches, write_touches,
};
use touchup::sim::Plate;
use touchup::stylus::ProbedPoint;

fn point() -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(Point3::from)
}

fn normal() -> impl Strategy<Value = Vector3<f64>> {
    let long = |v: &Vector3<f64>| v.norm() > 0.1;
    prop::array::uniform3(-1.0..1.0f64)
        .prop_map(Vector3::from)
        .prop_filter("too short", long)
        .prop_map(|v| v.normalize())
}

prop_compose! {
    fn touch()(
        places in (point(), point(), normal()),
        radius in prop_oneof![Just(0.0), Just(1.5e-3), 1e-4..1e-2],
        sigmas in [0.0..1e-3f64, 0.0..1e-3, 0.0..1e-3],
        weight in 0.0..1.0,
        is_rejected: bool,
        later in 0..1_000_000_000_000i64,
        stroke in 0..2u32,
    ) -> ProbedPoint {
        let ((centre, point, normal), [sigma, calibration, place]) = (places, sigmas);
        ProbedPoint {
            stamp_ns: later,
            stroke,
            centre,
            radius,
            point,
            normal,
            sigma,
            calibration,
            place,
            weight,
            is_rejected,
        }
    }
}

/// In order of time, as they come.
fn touches() -> impl Strategy<Value = Vec<ProbedPoint>> {
    prop::collection::vec(touch(), 0..20).prop_map(|mut touches| {
        let (mut stamp_ns, mut stroke) = (1_700_000_000_000_000_000, 0);
        for touch in &mut touches {
            (stamp_ns, stroke) = (stamp_ns + touch.stamp_ns, stroke + touch.stroke);
            (touch.stamp_ns, touch.stroke) = (stamp_ns, stroke);
        }
        touches
    })
}

proptest! {
    #[test]
    fn touches_come_back_to_the_digits_written(touches in touches()) {
        let file = tempfile::NamedTempFile::new().unwrap();
        write_touches(file.path(), &touches).unwrap();
        let read = read_touches(file.path()).unwrap();
        prop_assert_eq!(read.len(), touches.len());
        // half of the last digit, and the loss of the conversion to millimetres and back
        let (length, share, weight) = (0.51e-9, 1.1e-6, 0.51e-4);
        for (a, b) in read.iter().zip(&touches) {
            let of = |t: &ProbedPoint| (t.stamp_ns, t.stroke, t.is_rejected);
            prop_assert_eq!(of(a), of(b));
            prop_assert!((a.centre - b.centre).amax() < length && (a.point - b.point).amax() < length);
            prop_assert!((a.radius - b.radius).abs() <= 1e-15 * b.radius, "a radius is written in full");
            prop_assert!((a.normal - b.normal).amax() < share && (a.normal.norm() - 1.0).abs() < 1e-15);
            let sigmas = |t: &ProbedPoint| Vector3::new(t.sigma, t.calibration, t.place);
            prop_assert!((sigmas(a) - sigmas(b)).amax() < length);
            prop_assert!((a.weight - b.weight).abs() < weight);
        }
        prop_assert_eq!(read, as_written(&touches));

        // refine's own table equals the table made of its file
        let [direct, made] = [(); 2].map(|()| tempfile::Builder::new().suffix(".parquet").tempfile().unwrap());
        write_touches_as_named(direct.path(), &touches).unwrap();
        ResultTable::of_touches_file(file.path()).unwrap().write(made.path()).unwrap();
        prop_assert!(fs::read(direct.path()).unwrap() == fs::read(made.path()).unwrap());
    }

    /// Any value in some fields of a good line gives a touch of finite numbers, or an error that
    /// names the line.
    #[test]
    fn a_line_is_a_touch_or_its_error_is_named(
        changed in prop::collection::vec((0..17usize, "-?[0-9]{1,4}|[-+0-9.eE,naif ]{0,9}"), 1..4),
    ) {
        let changed: Vec<_> = changed.iter().map(|(at, text)| (*at, text.as_str())).collect();
        match read(&format!("{HEADER}\n{}\n", line(&changed))) {
            Ok(touches) => {
                let [touch] = touches.as_slice() else { panic!("{touches:?}") };
                let places = [touch.centre.coords, touch.point.coords, touch.normal];
                prop_assert!(places.iter().flatten().all(|x| x.is_finite()), "{touch:?}");
                prop_assert!((touch.normal.norm() - 1.0).abs() < 1e-15, "{touch:?}");
                let sizes = [touch.radius, touch.sigma, touch.calibration, touch.place, touch.weight];
                prop_assert!(sizes.iter().all(|x| x.is_finite() && *x >= 0.0), "{touch:?}");
            }
            Err(TouchesFileError::BadLine { line, what, .. }) => prop_assert!(line == 2 && !what.is_empty(), "{what}"),
            Err(error) => prop_assert!(false, "{error}"),
        }
    }
}

fn read(text: &str) -> Result<Vec<ProbedPoint>, TouchesFileError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), text).unwrap();
    read_touches(file.path())
}

const GOOD: [&str; 18] = [
    "0", "1000", "3", "1.5", "-2", "3e0", "1.5", "1", "2", "3", "0", "0", "1", "0.01", "0.002",
    "0.003", "0.5", "1",
];

/// A line with some fields changed.
fn line(changed: &[(usize, &str)]) -> String {
    let mut fields = GOOD;
    changed.iter().for_each(|(at, value)| fields[*at] = value);
    fields.join(",")
}

#[test]
fn a_line_is_read_by_its_columns() {
    let touches = read(&format!("{HEADER}\n{}\n", line(&[]))).unwrap();
    let expected = ProbedPoint {
        stamp_ns: 1000,
        stroke: 3,
        centre: Point3::new(1.5e-3, -2e-3, 3e-3),
        radius: 1.5e-3,
        point: Point3::new(1e-3, 2e-3, 3e-3),
        normal: Vector3::z(),
        sigma: 1e-5,
        calibration: 2e-6,
        place: 3e-6,
        weight: 0.5,
        is_rejected: true,
    };
    let [read] = touches.as_slice() else {
        panic!("{touches:?}")
    };
    assert!(
        (read.centre - expected.centre).norm() < 1e-15
            && (read.point - expected.point).norm() < 1e-15
    );
    assert_eq!(
        ProbedPoint {
            centre: expected.centre,
            point: expected.point,
            ..*read
        },
        expected
    );
}

/// As other programs save it.
#[test]
fn marks_of_other_programs_are_passed_over() {
    let plain = read(&format!("{HEADER}\n{}\n{}\n", line(&[]), line(&[(0, "1")]))).unwrap();
    assert_eq!(plain.len(), 2);
    let spaced = line(&[]).replace(',', " , ");
    for text in [
        format!(
            "\u{feff}{HEADER}\r\n{}\r\n{}\r\n",
            line(&[]),
            line(&[(0, "1")])
        ),
        format!("{HEADER}\n\n{spaced}\n\n{}", line(&[(0, "1")])),
    ] {
        assert_eq!(read(&text).unwrap(), plain, "{text:?}");
    }
    assert!(read(&format!("{HEADER}\n")).unwrap().is_empty());
}

#[test]
fn damaged_lines_are_named() {
    let two = |second: &str| format!("{HEADER}\n{}\n{second}\n", line(&[]));
    let later = |changed: &[(usize, &str)]| two(&line(&[&[(0, "1")], changed].concat()));
    let whole = line(&[(0, "1")]);
    let cases = [
        (two(whole.rsplit_once(',').unwrap().0), 3, "17 fields"),
        (two(&format!("{whole},0")), 3, "19 fields"),
        (two(&whole.replace(',', ";")), 3, "1 fields"),
        (two(&line(&[(0, "2")])), 3, "touch 2 where 1 comes"),
        (two(&line(&[])), 3, "touch 0 where 1 comes"),
        (
            format!("{HEADER}\n\n\n{whole}\n"),
            4,
            "touch 1 where 0 comes",
        ),
        (
            later(&[(1, "1e3")]),
            3,
            "stamp_ns \"1e3\" is no whole number",
        ),
        (later(&[(1, "999")]), 3, "stamp"),
        (later(&[(1, "9223372036854775807")]), 0, ""),
        (
            format!(
                "{HEADER}\n{}\n{}\n",
                line(&[(1, "-9223372036854775808")]),
                whole
            ),
            3,
            "stamp",
        ),
        (later(&[(2, "-1")]), 3, "stroke"),
        (later(&[(2, "5000000000")]), 3, "stroke"),
        (later(&[(2, "2")]), 3, "stroke"),
        (later(&[(4, "NaN")]), 3, "center_y_mm \"NaN\""),
        (later(&[(7, "inf")]), 3, "point_x_mm \"inf\""),
        (later(&[(9, "")]), 3, "point_z_mm \"\""),
        (later(&[(9, "1,5")]), 3, "19 fields"),
        (later(&[(6, "-1.5")]), 3, "tip_radius_mm is -1.5"),
        (later(&[(12, "0")]), 3, "normal"),
        (later(&[(13, "-0.1")]), 3, "sigma_mm"),
        (later(&[(14, "-0.1")]), 3, "calibration_mm"),
        (later(&[(15, "-0.1")]), 3, "place_mm"),
        (later(&[(16, "-0.1")]), 3, "weight"),
        (later(&[(17, "2")]), 3, "rejected"),
        (later(&[(17, "yes")]), 3, "rejected"),
    ];
    for (text, at, named) in &cases {
        match read(text) {
            Ok(_) => assert_eq!(*at, 0, "{named}: {text}"),
            Err(TouchesFileError::BadLine { line, what, .. }) => {
                assert!(
                    line == *at && what.contains(named),
                    "{named}: line {line}, {what}"
                );
            }
            Err(other) => panic!("{named}: {other}"),
        }
    }
}

#[test]
fn another_header_is_refused() {
    let body = line(&[]);
    for header in ["", "touch", &HEADER.replace("sigma", "Sigma"), &HEADER[1..]] {
        let error = read(&format!("{header}\n{body}\n")).unwrap_err();
        assert!(
            matches!(error, TouchesFileError::NoTouches { .. }),
            "{header}: {error}"
        );
        assert!(error.to_string().contains("--touches-out"));
    }
    // semicolons above commas
    let error = read(&format!("{}\n{body}\n", HEADER.replace(',', ";"))).unwrap_err();
    assert!(
        matches!(error, TouchesFileError::BadLine { line: 2, .. }),
        "{error}"
    );
    assert!(matches!(
        read("").unwrap_err(),
        TouchesFileError::NoTouches { .. }
    ));
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(
        read_touches(folder.path()).unwrap_err(),
        TouchesFileError::File(FileError::Read { .. })
    ));
    let nowhere = folder.path().join("no/touches.csv");
    assert!(matches!(
        write_touches(&nowhere, &[]).unwrap_err(),
        FileError::Write { .. }
    ));
}

/// The features of the drawing, one of them with the marks of a touched one.
fn features() -> Vec<Feature> {
    let plate = Plate::default().mesh(10e-6).unwrap();
    let mut features = detect(&plate, &[]).features;
    let hole = features
        .iter_mut()
        .find(|feature| feature.kind == FeatureKind::Hole)
        .unwrap();
    hole.group = Some(7);
    let diameter = hole.diameter.as_mut().unwrap();
    (diameter.std, diameter.touches) = (Some(3.25e-6), vec![2, 3, 4, 9, 11, 12, u32::MAX]);
    features
}

#[test]
fn features_come_back_bit_by_bit() {
    let features = features();
    let written = FeatureFile::of(&features, 0.125);
    let file = tempfile::NamedTempFile::new().unwrap();
    write_features(file.path(), &written).unwrap();
    let read = read_features(file.path()).unwrap();
    assert_eq!(
        serde_json::to_value(&read).unwrap(),
        serde_json::to_value(&written).unwrap()
    );
    assert_eq!(
        (read.features.len(), read.unexplained),
        (features.len(), Some(0.125))
    );
    for (record, feature) in read.features.iter().zip(&features) {
        assert_eq!(
            (record.id, record.kind.as_str(), record.group),
            (feature.id, feature.kind.name(), feature.group)
        );
        let centre = feature.centre.value;
        assert_eq!(
            record.center_mm.unwrap(),
            [centre.x * 1e3, centre.y * 1e3, centre.z * 1e3]
        );
        assert_eq!(
            record.axis,
            feature.axis.as_ref().map(|axis| axis.value.into())
        );
        assert_eq!(
            record.diameter_mm,
            feature
                .diameter
                .as_ref()
                .map(|diameter| diameter.value * 1e3)
        );
        assert_eq!(record.points_mm.len(), feature.points.len());
    }
    let hole = read
        .features
        .iter()
        .find(|record| record.group == Some(7))
        .unwrap();
    assert!((hole.std["diameter_mm"] - 3.25e-3).abs() < 1e-18);
    assert_eq!(
        hole.touches["diameter_mm"],
        [[2, 4], [9, 9], [11, 12], [u32::MAX, u32::MAX]]
    );
    let bytes = fs::read(file.path()).unwrap();
    write_features(file.path(), &read).unwrap();
    assert_eq!(fs::read(file.path()).unwrap(), bytes);
    // the tables of refine and features equal those made of that file
    for ending in [".csv", ".parquet"] {
        let [direct, made] =
            [(); 2].map(|()| tempfile::Builder::new().suffix(ending).tempfile().unwrap());
        write_features_as_named(direct.path(), &written).unwrap();
        ResultTable::of_features(&read.features)
            .write(made.path())
            .unwrap();
        assert!(fs::read(direct.path()).unwrap() == fs::read(made.path()).unwrap());
        assert!(fs::read(direct.path()).unwrap() != bytes, "{ending}");
    }
}

/// As the judge's README shows it: without unknown values.
#[test]
fn files_of_others_are_read() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = r#"{"features": [{"kind": "hole", "center_mm": [1, 2.5, 3], "axis": [0, 0, 1], "diameter_mm": 6, "through": true},
        {"kind": "edge", "points_mm": [[0, 0, 0], [1, 0, 0]]}]}"#;
    fs::write(file.path(), text).unwrap();
    let read = read_features(file.path()).unwrap();
    let [hole, edge] = read.features.as_slice() else {
        panic!("{read:?}")
    };
    assert_eq!(
        (hole.center_mm, hole.diameter_mm, hole.depth_mm),
        (Some([1.0, 2.5, 3.0]), Some(6.0), None)
    );
    assert_eq!(
        (edge.points_mm.as_slice(), edge.axis),
        (&[[0.0; 3], [1.0, 0.0, 0.0]][..], None)
    );
    for damaged in [
        "",
        "{}",
        "[]",
        r#"{"features": [{"center_mm": [1, 2, 3]}]}"#,
        &text[..80],
    ] {
        fs::write(file.path(), damaged).unwrap();
        let error = read_features(file.path()).unwrap_err();
        assert!(
            matches!(error, FeaturesFileError::NoFeatures { .. }),
            "{damaged}: {error}"
        );
        assert!(
            error.to_string().contains("is no file of features"),
            "{error}"
        );
    }
    let missing = read_features(&file.path().join("no.json")).unwrap_err();
    assert!(matches!(
        missing,
        FeaturesFileError::File(FileError::Read { .. })
    ));
}
