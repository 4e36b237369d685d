use super::*;

fn read(text: &str, columns: &TableColumns) -> Result<Vec<Result<TableRow, BadMessage>>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("touch.csv");
    std::fs::write(&path, text).unwrap();
    let mut table = NumberTable::open(&path, columns).map_err(|error| error.to_string())?;
    Ok(std::iter::from_fn(|| table.next_row().unwrap()).collect())
}

fn names(names: &[&str]) -> Option<Vec<String>> {
    Some(names.iter().map(|name| (*name).to_owned()).collect())
}

#[test]
fn a_time_keeps_its_last_digit() {
    for (text, factor, ns) in [
        ("1700000000.123456789", 1.0, 1_700_000_000_123_456_789),
        ("-0.5", 1.0, -500_000_000),
        ("12", 1e-3, 12_000_000),
        ("1.5", 1e-9, 2),
        ("1700000000123456789", 1e-9, 1_700_000_000_123_456_789),
        ("1e-3", 1.0, 1_000_000),
        ("7.", 1.0, 7_000_000_000),
    ] {
        assert_eq!(nanoseconds(text, factor), Some(ns), "{text}");
    }
    for bad in [
        "",
        "a",
        "1e300",
        "99999999999999999999",
        "nan",
        "1.2.3",
        "inf",
    ] {
        assert_eq!(nanoseconds(bad, 1.0), None, "{bad}");
    }
}

#[test]
fn a_log_of_rtde_needs_no_names() {
    let names = |what: &str, count: usize| {
        (0..count)
            .map(|at| format!("{what}_{at}"))
            .collect::<Vec<_>>()
    };
    let header: Vec<_> = [
        vec!["timestamp".to_owned()],
        names("actual_q", 6),
        names("actual_TCP_pose", 6),
    ]
    .into_iter()
    .chain([names("actual_TCP_force", 6)])
    .flatten()
    .collect();
    let values = "12.5 9 9 9 9 9 9 0.1 0.2 0.3 0 0 1.5707963267948966 1 2 3 4 5 6";
    for separator in [",", " "] {
        let text = format!(
            "{}\n{}\n",
            header.join(separator),
            values.replace(' ', separator)
        );
        let rows = read(&text, &TableColumns::default()).unwrap();
        let row = rows[0].as_ref().unwrap();
        let (pose, wrench) = (row.pose.unwrap(), row.wrench.unwrap());
        assert_eq!(
            (pose.stamp_ns, wrench.stamp_ns),
            (12_500_000_000, 12_500_000_000)
        );
        assert_eq!(pose.pose_ot.translation.vector, Vector3::new(0.1, 0.2, 0.3));
        assert!((pose.pose_ot.rotation * Vector3::x() - Vector3::y()).norm() < 1e-15);
        let Wrench { force, torque } = wrench.wrench;
        assert_eq!(
            (force, torque),
            (Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0))
        );
    }
}

#[test]
fn columns_are_named_in_the_scene_with_the_unit_that_the_header_lacks() {
    let columns = TableColumns {
        position: names(&["a [mm]", "b [mm]", "c [mm]"]),
        force: names(&["u", "v", "w"]),
        ..TableColumns::default()
    };
    let text = "t_ms;a;b;c;u_N;v_N;w_N\n# at rest\n\n1;1000;0;0;1;2;3\n2;;;;1;2;3\n3;1;2;3;;;\n4;1;;3;1;2;3\n5;x;2;3;1;2;3\n6;1\n";
    let rows = read(text, &columns).unwrap();
    let there: Vec<_> = rows
        .iter()
        .map(|row| {
            row.as_ref()
                .map(|row| (row.pose.is_some(), row.wrench.is_some()))
                .map_err(|bad| *bad)
        })
        .collect();
    let bad = Err(BadMessage::Malformed);
    assert_eq!(
        there,
        [
            Ok((true, true)),
            Ok((false, true)),
            Ok((true, false)),
            bad,
            bad,
            bad
        ]
    );
    let first = rows[0].as_ref().unwrap();
    assert_eq!(
        first.pose.unwrap().pose_ot.translation.vector,
        Vector3::new(1.0, 0.0, 0.0)
    );
    assert_eq!(first.pose.unwrap().stamp_ns, 1_000_000);
}

fn why(text: &str, columns: &TableColumns) -> String {
    read(text, columns).err().unwrap()
}

#[test]
fn what_is_not_understood_is_answered_by_the_columns_and_the_key() {
    let usual = TableColumns::default();
    let text = why("a,b\n1,2\n", &usual);
    assert!(
        text.contains("columns: { time: … }") && text.contains("It has: a, b"),
        "{text}"
    );
    let text = why("t_s,x,y,z,fx_n,fy_n,fz_n\n", &usual);
    assert!(
        text.contains("\"x\" has no unit (m, mm, um or inch)") && text.contains("x [mm]"),
        "{text}"
    );
    for header in [
        "t_s,x_mm,y_mm,z_mm,x_m,fx_n,fy_n,fz_n\n",
        "t_s,x_m,y_m,z_m,x_m,fx_n,fy_n,fz_n\n",
    ] {
        let text = why(header, &usual);
        assert!(
            text.contains("and \"x_m\" could both be meant by the position"),
            "{text}"
        );
    }
    let wanted = TableColumns {
        position: names(&["x_mm", "y_mm", "z_mm"]),
        ..usual.clone()
    };
    assert!(read("t_s,x_mm,y_mm,z_mm,x_m,fx_n,fy_n,fz_n\n", &wanted).is_ok());
    let wanted = TableColumns {
        force: names(&["u", "v", "w"]),
        ..usual.clone()
    };
    let text = why("t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n\n", &wanted);
    assert!(
        text.contains("no column \"u\"") && text.contains("columns.force") && text.contains("fz_n"),
        "{text}"
    );
    let wanted = TableColumns {
        position: names(&["x [mm]", "y [mm]", "z [mm]"]),
        ..usual.clone()
    };
    assert!(why("t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n\n", &wanted).contains("another unit"));
    let wanted = TableColumns {
        wrench_axes: WrenchAxes::Tip,
        ..usual.clone()
    };
    assert!(
        why("t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n\n", &wanted)
            .contains("wrench_axes: tip needs an orientation")
    );
}

#[test]
fn tables_with_a_bad_line_are_refused_with_its_number() {
    let usual = TableColumns::default();
    let header = "t_s;x_m;y_m;z_m;qx;qy;qz;qw;fx_n;fy_n;fz_n\n";
    for (line, word) in [
        (
            "0,5;0.1;0.2;0.3;0;0;0;1;1;2;3\n",
            "line 2 has a value that is no number",
        ),
        ("x;0.1;0.2;0.3;0;0;0;1;1;2;3\n", "the time in line 2"),
        (
            "0;0.1;0.2;0.3;0;0;0;2;1;2;3\n",
            "the orientation in line 2 has not the length 1",
        ),
        (
            "0;0.1;0.2;0.3;0;0;0;1;1;2\n",
            "line 2 has 10 values for 11 columns",
        ),
    ] {
        let text = why(&[header, line].concat(), &usual);
        assert!(text.contains(word), "{text}");
    }
    assert!(why("1,2,3\n", &usual).contains("numbers alone"));
    assert!(why("", &usual).contains("empty"));
    assert!(why(&"a".repeat(100_000), &usual).contains("over the limit"));
    let open = why(&[header, "0;\"0.1;0.2\n1;2\n"].concat(), &usual);
    assert!(
        open.contains("line 2: a value in quotation marks runs out"),
        "{open}"
    );
}

/// As saved by a spreadsheet with decimal commas.
#[test]
fn a_table_has_one_decimal_sign_and_may_have_quotation_marks() {
    let header = "\u{feff}\"t_s\";\"x, of the tip [mm]\";y_mm;z_mm;fx_n;fy_n;fz_n\r\n";
    let columns = TableColumns {
        position: names(&["x, of the tip [mm]", "y_mm", "z_mm"]),
        ..TableColumns::default()
    };
    let rows = "\"1795000000,000000001\";1000,5;0;\"2,5\";1;2;-3,25\r\n2;1.5;0;0;1;2;3\r\n";
    let rows = read(&[header, rows].concat(), &columns).unwrap();
    let first = rows[0].as_ref().unwrap();
    let pose = first.pose.unwrap();
    assert_eq!(pose.stamp_ns, 1_795_000_000_000_000_001);
    let expected = Vector3::new(1.0005, 0.0, 0.0025);
    assert!((pose.pose_ot.translation.vector - expected).norm() < 1e-15);
    assert_eq!(
        first.wrench.unwrap().wrench.force,
        Vector3::new(1.0, 2.0, -3.25)
    );
    assert_eq!(rows[1].as_ref().map(|_| ()), Err(&BadMessage::Malformed));
}
