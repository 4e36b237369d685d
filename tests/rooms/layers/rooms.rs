//! The rooms: the files of each, and the other rooms that it may use.

/// Each room and the rooms it may use; itself always. A room that is missing here fails the check.
/// A crate of [`WHOLE`] is one room. Circles between crates need no check: cargo refuses them.
pub const MAY_USE: &[(&str, &str)] = &[
    ("clock", ""),
    ("log_lines", ""),
    ("threads", "mesh"),
    ("numeric", ""),
    ("parameters", ""),
    ("stylus", "numeric parameters"),
    ("mesh", "numeric"),
    ("reconstruct", "numeric parameters stylus mesh brep"),
    ("haptic", "numeric parameters stylus mesh reconstruct"),
    ("live", "clock stylus mesh reconstruct haptic threads"),
    (
        "plan",
        "numeric parameters stylus mesh brep reconstruct features conformity",
    ),
    ("arm", "numeric parameters stylus plan"),
    (
        "execute",
        "numeric parameters stylus mesh reconstruct features calibrate plan arm",
    ),
    ("sim", "numeric stylus mesh features calibrate diagnose arm"),
    ("form", "numeric"),
    ("brep", "numeric"),
    ("features", "numeric stylus mesh form brep"),
    ("conformity", "numeric features"),
    ("align", "numeric mesh features"),
    ("compare", "numeric stylus mesh align features"),
    ("calibrate", "numeric stylus mesh align features"),
    ("adjustment", "numeric stylus features"),
    ("diagnose", "numeric stylus mesh adjustment"),
    (
        "io",
        "numeric parameters stylus mesh form brep reconstruct features conformity align arm execute",
    ),
    ("scan", "mesh reconstruct io threads"),
    (
        "scene",
        "parameters stylus mesh reconstruct haptic diagnose plan arm execute sim io",
    ),
    ("probing_run", "plan arm execute"),
    ("replay", "numeric stylus reconstruct io scene"),
    (
        "session",
        "clock numeric stylus mesh brep reconstruct haptic live features io threads scan replay",
    ),
    (
        "refinement",
        "numeric stylus mesh reconstruct haptic live diagnose io threads scan scene replay session",
    ),
    (
        "sweep",
        "stylus mesh features compare sim io threads scan scene replay session refinement",
    ),
    ("document", ""),
    (
        "inspect",
        "document numeric stylus mesh features conformity align compare io scan scene session",
    ),
    (
        "calibration",
        "stylus align calibrate execute io scene replay",
    ),
    ("input_check", "stylus mesh diagnose threads scene replay"),
    (
        "report",
        "numeric stylus mesh reconstruct haptic live features align sim compare diagnose io scan scene session replay document",
    ),
    (
        "python",
        "numeric parameters stylus mesh reconstruct haptic live features align sim compare diagnose io threads scan scene session replay refinement sweep",
    ),
    ("ur", "clock stylus plan arm"),
    (
        "ros",
        "parameters clock log_lines stylus mesh reconstruct live arm io scene threads",
    ),
    (
        "node",
        "clock stylus mesh reconstruct haptic live form features plan arm execute sim diagnose io scan scene session probing_run replay refinement \
         threads ros",
    ),
    (
        "page",
        "clock stylus mesh conformity arm diagnose io inspect input_check calibration scan scene session replay \
         threads ros node",
    ),
    ("ros2_control", "clock stylus plan arm scene ros"),
    (
        "cli",
        "clock numeric stylus mesh reconstruct haptic live features conformity plan arm execute sim align \
         calibrate compare diagnose io threads scan scene session probing_run replay refinement sweep document inspect input_check calibration ros \
         node page ros2_control ur",
    ),
];

/// Same input, same bytes out: nothing of the world outside comes in.
pub const PURE: &[&str] = &[
    "touchup-geometry",
    "touchup-method",
    "touchup-features",
    "touchup-probing",
    "touchup-sim",
    "touchup-document",
];

/// The only places with Python.
pub const MAY_USE_PYTHON: &[&str] = &[
    "crates/touchup-node/src/ur/child/",
    "crates/touchup-python/",
];

/// Paths that a pure crate may not name.
pub const IMPURE_PATHS: &[&str] = &[
    "std::fs",
    "std::thread",
    "std::env",
    "std::io",
    "std::net",
    "std::process",
];
pub const IMPURE_NAMES: &[&str] = &[
    "Instant",
    "SystemTime",
    "println",
    "eprintln",
    "print",
    "eprint",
    "dbg",
];

/// The only places with file access.
pub const MAY_OPEN_FILES: &[&str] = &["crates/touchup-io/", "crates/touchup-session/src/scene/"];

/// The files that ask the system about itself, which answers by files: the packet sizes of its
/// networks, the open sockets, the priority of a thread.
pub const MAY_ASK_THE_SYSTEM: &[&str] = &[
    "crates/touchup-session/src/threads.rs",
    "crates/touchup-node/src/ros/dds/answers.rs",
    "crates/touchup-node/src/ros/dds/sockets.rs",
];

/// Crates that are one room each, as other crates name them, and its name.
pub const WHOLE: &[(&str, &str)] = &[
    ("touchup_sim", "sim"),
    ("touchup_io", "io"),
    ("touchup_document", "document"),
    ("touchup_inspect", "inspect"),
    ("touchup_report", "report"),
    ("touchup_python", "python"),
];

/// Crates with several rooms, as other crates name them.
pub const WITH_ROOMS: &[&str] = &[
    "touchup_geometry",
    "touchup_method",
    "touchup_features",
    "touchup_probing",
    "touchup_session",
    "touchup_node",
];

/// Place of a file.
pub struct Place<'a> {
    pub package: &'a str,
    /// empty for `lib.rs` and `main.rs` of a crate with several
    pub room: &'a str,
    /// depth of the module, if the crate has several rooms; 0 if all of it is one
    pub depth: usize,
}

impl<'a> Place<'a> {
    /// Of a file's path in the repository.
    pub fn of(file: &'a str) -> Self {
        let (package, path) = match file.strip_prefix("crates/") {
            Some(file) => file.split_once("/src/").unwrap(),
            None => ("touchup", file.strip_prefix("src/").unwrap()),
        };
        let path = path.strip_suffix(".rs").unwrap();
        let path = path.strip_suffix("/mod").unwrap_or(path);
        let name = package.replace('-', "_");
        let whole = WHOLE.iter().find(|(whole, _)| *whole == name);
        let (room, depth) = match (whole, path) {
            (Some((_, room)), _) => (*room, 0),
            (None, "lib" | "main") => ("", 0),
            (None, _) => (path.split('/').next().unwrap(), path.split('/').count()),
        };
        Self {
            package,
            room,
            depth,
        }
    }
}
