//! Output of `generate/` from files of message definitions. The expected text is hand-written.

#[path = "../../../crates/touchup-node/generate/definition.rs"]
mod definition;
#[path = "../../../crates/touchup-node/generate/rust.rs"]
mod rust;

use definition::parse;

const ALL: &str = "\
# A part.
#
# Its second paragraph, with
# a list [1] in it.

# one at all
uint8 ONE=1
uint8 TWO=2
string NAME='a name'
# which one
uint8 kind
# how far, m
float64 far 0.5
float64 farther

# its letters
string<=10 type
# corners
Point[<=4] corners
# three of them
int32[3] three # in a row
";
const POINT: &str = "float32 x # m\n";

const STRUCTS: &str = r#"/// A part.
///
/// Its second paragraph, with a list \[1] in it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Part {
    /// which one
    pub kind: u8,
    /// how far, m
    pub far: f64,
    /// how far, m
    pub farther: f64,
    /// its letters; at most 10 letters
    pub r#type: String,
    /// corners; at most 4 items
    pub corners: Vec<Point>,
    /// in a row
    pub three: [i32; 3],
}
impl Part {
    /// one at all
    pub const ONE: u8 = 1;
    /// a value of [`Self::kind`]
    pub const TWO: u8 = 2;
    /// a value of [`Self::kind`]
    pub const NAME: &str = "a name";
}
impl Default for Part {
    fn default() -> Self {
        Self {
            kind: Default::default(),
            far: 0.5_f64,
            farther: Default::default(),
            r#type: Default::default(),
            corners: Default::default(),
            three: Default::default(),
        }
    }
}
impl RosMessage for Part {
    const TYPE_NAME: &'static str = "own/msg/Part";
}

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, Copy, Default)]
pub struct Point {
    /// m
    pub x: f32,
}
impl RosMessage for Point {
    const TYPE_NAME: &'static str = "own/msg/Point";
}

"#;

#[test]
fn constants_defaults_bounds_and_comments_come_along() {
    let mut messages = parse("own", "msg/Part.msg", ALL).unwrap();
    messages.extend(parse("own", "msg/Point.msg", POINT).unwrap());
    assert_eq!(rust::structs(&messages).unwrap(), STRUCTS);
}

#[test]
fn parts_of_a_service_are_named_for_it_and_an_empty_one_has_a_byte() {
    let messages = parse(
        "touchup_msgs",
        "srv/Look.srv",
        "# Looks.\n\n---\n# how many\nuint32 count\n",
    )
    .unwrap();
    let text = rust::structs(&messages).unwrap();
    assert!(
        text.starts_with("/// Request of the service `Look`.\n///\n/// Looks.\n#[derive("),
        "{text}"
    );
    for part in [
        "pub struct LookRequest {\n    /// 0, means nothing\n    pub structure_needs_at_least_one_member: u8,\n}",
        "\"touchup_msgs/srv/Look_Request\"",
        "/// Response of the service `Look`.\n#[derive(",
        "pub struct LookResponse {\n    /// how many\n    pub count: u32,\n}",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let service = "pub enum Look {}\nimpl RosService for Look {\n    type Request = LookRequest;\n    type Response = LookResponse;\n";
    assert!(text.contains(service), "{text}");
    let conversions = [
        "message!(LookRequest = super::touchup_msgs::srv::Look::Request { });",
        "service!(Look = super::touchup_msgs::srv::Look::Service);",
        "message!(LookResponse = super::touchup_msgs::srv::Look::Response { count: count, });",
    ];
    assert_eq!(
        rust::conversions(&messages).lines().collect::<Vec<_>>(),
        conversions
    );
    assert_eq!(
        rust::carried(&messages),
        "carried!(LookRequest, LookResponse);\n"
    );
    assert!(rust::stand_ins(&messages).contains("\nservice!(Look { } { count: u32, });\n"));
}

#[test]
fn what_is_no_definition_is_refused_by_name() {
    for (path, text, reason) in [
        (
            "msg/A.msg",
            "uint8\n",
            "msg/A.msg: \"uint8\" has a type and no name",
        ),
        (
            "msg/A.msg",
            "uint8[x] a\n",
            "msg/A.msg: a has a length that is no number: x",
        ),
        ("srv/A.srv", "uint8 a\n", "srv/A.srv: 1 parts, a .srv has 2"),
        (
            "msg/A.idl",
            "",
            "msg/A.idl: it ends in .idl, definitions end in .msg, .srv or .action",
        ),
    ] {
        assert_eq!(parse("own", path, text).unwrap_err(), reason);
    }
    let unknown = parse("own", "msg/A.msg", "geometry_msgs/Twist twist\n").unwrap();
    let reason = "geometry_msgs/Twist is no type: is it described below src/ros/messages/standard?";
    assert_eq!(rust::structs(&unknown).unwrap_err(), reason);
}

/// Messages as `web/src/messages.ts` has them; whether with all of their fields.
const OF_PAGE: [(&str, &str, bool); 9] = [
    ("Feature", "msg/msg/Feature.msg", true),
    ("FormDeviation", "msg/msg/FormDeviation.msg", true),
    ("Relation", "msg/msg/Relation.msg", true),
    ("FeatureArray", "msg/msg/FeatureArray.msg", true),
    ("Mismatch", "msg/msg/HapticMismatch.msg", false),
    ("ProbeResult", "msg/msg/ProbeResult.msg", false),
    ("ProbeTouch", "msg/msg/ProbeTouch.msg", false),
    (
        "Marker",
        "crates/touchup-node/src/ros/messages/standard/visualization_msgs/Marker.msg",
        false,
    ),
    (
        "DiagnosticStatus",
        "crates/touchup-node/src/ros/messages/standard/diagnostic_msgs/DiagnosticStatus.msg",
        false,
    ),
];

fn in_tree(path: &str) -> String {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    std::fs::read_to_string(format!("{root}/{path}")).unwrap()
}

/// Names and types of an interface; those of `Stated` are numbers with a `_std`.
fn fields_of_page(page: &str, name: &str) -> Vec<(String, String)> {
    let begin = page.find(&format!("export interface {name} ")).unwrap();
    let (head, body) = page[begin..].split_once("{\n").unwrap();
    let stated = head.split('"').skip(1).step_by(2);
    let numbers = stated.flat_map(|number| [number.to_owned(), format!("{number}_std")]);
    let lines = body[..body.find("\n}").unwrap()].lines();
    let fields = lines.filter_map(|line| line.trim().strip_suffix(';')?.split_once(": "));
    numbers
        .map(|number| (number, "Num".to_owned()))
        .chain(fields.map(|(field, item)| (field.to_owned(), item.to_owned())))
        .collect()
}

/// Type of a field in the page: NaN is `null` there.
fn type_of_page(field: &definition::Field) -> String {
    let item = match field.item.rsplit('/').next().unwrap() {
        "bool" => "boolean",
        "float32" | "float64" => "Num",
        "Point" | "Vector3" => "Xyz",
        basic if basic == "byte" || basic.contains("int") => "number",
        other => other,
    };
    match field.length {
        definition::Length::One => item.to_owned(),
        _ => format!("{item}[]"),
    }
}

#[test]
fn types_of_the_page_are_those_of_the_messages() {
    let page = in_tree("web/src/messages.ts");
    for (name, path, is_whole) in OF_PAGE {
        let message = &parse("touchup_msgs", path, &in_tree(path)).unwrap()[0];
        let of_page = fields_of_page(&page, name);
        for (field, item) in &of_page {
            let defined = message.fields.iter().find(|one| one.name == *field);
            let defined = defined.unwrap_or_else(|| panic!("{path} has no {field}"));
            // of messages within messages the page has parts alone
            let is_same = item.contains('{') || *item == type_of_page(defined);
            assert!(is_same, "{name}.{field} is {item}, and not as in {path}");
        }
        let missing = message
            .fields
            .iter()
            .find(|field| is_whole && of_page.iter().all(|(one, _)| *one != field.name));
        assert!(missing.is_none(), "the page's {name} lacks {missing:?}");
    }
}

#[test]
fn constants_of_the_page_are_those_of_the_messages() {
    let page = in_tree("web/src/messages.ts");
    let constants = |path: &str| parse("", path, &in_tree(path)).unwrap().remove(0).constants;
    for (name, prefix) in [
        ("Kind", "KIND_"),
        ("Status", "STATUS_"),
        ("FittedTo", "FITTED_TO_"),
    ] {
        let begin = page.find(&format!("export const {name} = {{")).unwrap();
        let text = &page[begin..begin + page[begin..].find('}').unwrap()];
        let mut of_page: Vec<_> = text.split(['{', ',']).skip(1).map(str::trim).collect();
        of_page.retain(|constant| !constant.is_empty());
        let defined = constants("msg/msg/Feature.msg")
            .into_iter()
            .filter_map(|constant| {
                let name = constant.name.strip_prefix(prefix)?.to_lowercase();
                Some(format!("{name}: {}", constant.value))
            });
        assert_eq!(of_page, defined.collect::<Vec<_>>(), "{name}");
    }
    let results = constants("msg/msg/ProbeResult.msg");
    let value = |name: &str| &results.iter().find(|one| one.name == name).unwrap().value;
    for (of_page, name) in [("PLANNED", "PLANNED"), ("STOPPED_FROM", "FORCE_OVER_LIMIT")] {
        assert!(
            page.contains(&format!("export const {of_page} = {};", value(name))),
            "{of_page}"
        );
    }
}
