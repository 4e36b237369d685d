//! What `generate/` makes of the files that define messages. The expected text is written by hand.

#[path = "../../../generate/definition.rs"]
mod definition;
#[path = "../../../generate/rust.rs"]
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
