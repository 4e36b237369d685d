//! Answers that go out whole.
//!
//! RustDDS 0.15.1 writes the inline QoS of a fragment unreadably, and ros2-client names the request
//! of an answer there: an answer in fragments is lost. So for answers by ros2-client, in the
//! enhanced mapping (Fast DDS) and of the action in either mapping, an answer has to fit into one
//! packet: our own do by design, except for long texts, and callers ask for fewer parameters at a
//! time. A larger answer goes out as the same message with less content, and the log says so. The
//! services in the mapping of CycloneDDS are our own ([`super::services`]) and have no such limit.

use std::collections::BTreeSet;
use std::fs;
use std::sync::Mutex;

use byteorder::LittleEndian;
use ros2_client::ServiceMapping;
use ros2_client::action::GetResultResponse;

use crate::ros::locked;
use crate::ros::messages::*;

/// Largest packet of a network, in bytes: Ethernet's, which RustDDS also assumes unless it knows a
/// smaller one.
pub(super) const ETHERNET: usize = 1500;
/// Bytes of a packet besides the answer: headers of IP (20), UDP (8) and RTPS (20), INFO_DST (16),
/// INFO_TS (12), DATA (24), the two parameters that name the request and the end of their list
/// (60), HEARTBEAT (32). RustDDS counts 128 of them and fragments larger answers; within all of
/// them IP does not split a packet either.
const HEADERS: usize = 192;
/// Excess up to which RustDDS makes no fragments and IP splits the packet: better than an empty
/// list.
const PARTED_BY_IP: usize = 64;
/// Four bytes before a message that specify its encoding.
const ENCAPSULATION: usize = 4;

/// An answer that can be made smaller.
pub(super) trait Shrinkable: ros2_client::Message {
    /// Reduces the message to a number of bytes, least important content first. The rest stays
    /// true.
    fn reduce(&mut self, most: usize);
}

/// Maximum size of answers.
pub(super) struct Room {
    /// bytes in one packet
    most: usize,
    /// whether answers of services have to fit into one packet
    is_for_services: bool,
    /// services already logged
    logged: Mutex<BTreeSet<&'static str>>,
}

impl Room {
    /// Room in the networks of this computer.
    pub fn new(mapping: &ServiceMapping) -> Self {
        let is_for_services = *mapping != ServiceMapping::Cyclone;
        Self {
            most: room(smallest_packet()),
            is_for_services,
            logged: Mutex::default(),
        }
    }

    /// The answer of a service, reduced if necessary.
    pub fn fit<A: Shrinkable>(&self, service: &'static str, answer: A) -> A {
        if self.is_for_services {
            self.fit_packet(service, answer)
        } else {
            answer
        }
    }

    /// The answer, reduced to one packet if necessary.
    pub fn fit_packet<A: Shrinkable>(&self, service: &'static str, mut answer: A) -> A {
        let bytes = size(&answer);
        if bytes <= self.most {
            return answer;
        }
        answer.reduce(self.most);
        if size(&answer) < bytes && locked(&self.logged).insert(service) {
            tracing::warn!(service, bytes, most = self.most, "{TOO_LARGE}");
        }
        answer
    }
}

const TOO_LARGE: &str = "an answer does not fit into one packet, and RustDDS loses larger ones with service_mapping enhanced: it goes \
                         out with less in it; ask for fewer names at a time, or start the node with service_mapping:=cyclone \
                         (RMW_IMPLEMENTATION=rmw_cyclonedds_cpp for all), or build it with the feature r2r";

/// Bytes of a packet available for an answer.
pub(super) fn room(packet: usize) -> usize {
    packet.saturating_sub(HEADERS)
}

/// Smallest packet of all active networks, according to Linux; elsewhere Ethernet's.
fn smallest_packet() -> usize {
    let read = |path: std::path::PathBuf| {
        fs::read_to_string(path)
            .map(|text| text.trim().to_owned())
            .ok()
    };
    let devices = fs::read_dir("/sys/class/net")
        .into_iter()
        .flatten()
        .flatten();
    let up = devices.filter(|device| {
        read(device.path().join("operstate")).is_some_and(|state| state != "down")
    });
    let packets = up.filter_map(|device| read(device.path().join("mtu"))?.parse().ok());
    packets.fold(ETHERNET, usize::min)
}

/// Size on the wire.
pub(super) fn size(answer: &impl ros2_client::Message) -> usize {
    // an unwritable message is not sent, and logged at that point
    cdr_encoding::to_vec::<_, LittleEndian>(answer).map_or(0, |bytes| bytes.len() + ENCAPSULATION)
}

/// Shortens a text by at least this number of bytes, as far as possible.
fn cut(text: &mut String, by: usize) {
    const MORE: &str = " …";
    if by == 0 {
        return;
    }
    let mut end = text.len().saturating_sub(by + MORE.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.truncate(end);
    if end > 0 {
        text.push_str(MORE);
    }
}

/// Excess bytes, plus the alignment of the next field after the text.
fn excess(answer: &impl ros2_client::Message, most: usize) -> usize {
    let too_many = size(answer).saturating_sub(most);
    if too_many > 0 { too_many + 8 } else { 0 }
}

/// Answers whose only unlimited parts are texts: `texts!(Answer: text, text)`, least important
/// first.
macro_rules! texts {
    ($($answer:ty: $($($field:ident).+),+;)+) => {
        $(impl Shrinkable for $answer {
            fn reduce(&mut self, most: usize) {
                $(let too_many = excess(self, most);
                cut(&mut self.$($field).+, too_many);)+
            }
        })+
    };
}

texts! {
    FlagFeatureResponse: message;
    UnflagFeatureResponse: message;
    DetectFeaturesResponse: message;
    // the message also contains the path; its remainder is the cause
    SaveMeshResponse: message, path;
    ResyncMeshResponse: message, session;
    UndoResponse: message;
    TakeOutTouchResponse: message;
    TriggerResponse: message;
    SetBoolResponse: message;
    ProbeFeatureResponse: result.message, result.header.frame_id;
    GetResultResponse<ProbeResponse>: result.message, result.header.frame_id;
    SetParametersAtomicallyResponse: result.reason;
}

/// Answers with a list: `lists!(Answer: list of item type, [reduction of each item, in order])`;
/// after them the whole list goes.
macro_rules! lists {
    ($($answer:ty: $($list:ident).+ of $item:ty, $steps:expr;)+) => {
        $(impl Shrinkable for $answer {
            fn reduce(&mut self, most: usize) {
                let steps: &[fn(&mut $item)] = &$steps;
                for shorten in steps {
                    if size(self) > most {
                        self.$($list).+.iter_mut().for_each(shorten);
                    }
                }
                if size(self) > most + PARTED_BY_IP {
                    self.$($list).+.clear();
                }
            }
        })+
    };
}

lists! {
    // a value for each name, or none
    GetParametersResponse: values of ParameterValue, [];
    GetParameterTypesResponse: types of u8, [];
    ListParametersResponse: result.names of String, [];
    // programs need types and ranges, and words to choose from if they fit
    DescribeParametersResponse: descriptors of ParameterDescriptor, [|one| one.description.clear(), |one| one.additional_constraints.clear()];
    // whether each was set matters more than why not
    SetParametersResponse: results of SetParametersResult, [|one| one.reason.clear()];
}

#[cfg(test)]
mod tests {
    use ros2_client::action::{GoalId, GoalInfo, GoalStatusEnum, SendGoalResponse};
    use ros2_client::action_msgs::CancelGoalResponseEnum;
    use ros2_client::builtin_interfaces::Time;

    use super::*;
    use crate::ros::messages::{
        self, DescribeParametersRequest, Feature, GetParametersRequest, Header,
        ListParametersRequest, ListParametersResult, Point, ProbeResult, SetParametersResult,
    };
    use crate::ros::parameter_services::{describe_all, get, list, result as set_result};
    use crate::ros::parameters::{
        PARAMETERS, ParameterDescriptor, ParameterValue, Parameters, Settable,
    };

    /// Smallest packet of today's networks: the minimum of IPv6, also of tunnels.
    const TUNNEL: usize = 1280;

    fn long() -> String {
        "Ø 8.02 is not to be had: ".repeat(400)
    }

    /// Asserts that an answer fits after reduction, whatever its texts.
    fn fits<A: Shrinkable>(mut answer: A) -> A {
        assert!(size(&answer) > ETHERNET, "{}", size(&answer));
        answer.reduce(room(TUNNEL));
        assert!(size(&answer) <= room(TUNNEL), "{} bytes", size(&answer));
        answer
    }

    fn result(message: String) -> ProbeResult {
        ProbeResult {
            header: Header {
                frame_id: "object".to_owned(),
                ..Header::default()
            },
            message,
            feature: Feature {
                points: vec![Point::default(); 2],
                ..Feature::default()
            },
            ..ProbeResult::default()
        }
    }

    #[test]
    #[expect(clippy::too_many_lines)]
    fn the_largest_answers_of_our_own_services_fit_into_one_packet() {
        // the longest text of the node itself; a path may be longer
        let message = || {
            "a text of 300 letters, which is longer than what the node says by itself. ".repeat(4)
        };
        let header = Header {
            frame_id: "object".to_owned(),
            ..Header::default()
        };
        let (ids, codes) = ((0..128).collect::<Vec<u32>>(), vec![1; 128]);
        let detected = DetectFeaturesResponse {
            message: message(),
            ids: ids.clone(),
            ..DetectFeaturesResponse::default()
        };
        let ended = ProbeResponse {
            header,
            code: 1,
            message: message(),
            ids,
            codes,
        };
        let goal = GoalInfo {
            goal_id: GoalId::new_random(),
            stamp: Time::ZERO,
        };
        let cancelled = ros2_client::action_msgs::CancelGoalResponse {
            return_code: CancelGoalResponseEnum::None,
            goals_canceling: vec![goal; 32],
        };
        let path = "/home/somebody/sessions/2026-01-31T12-00-00/refined.ply".repeat(2);
        let saved = SaveMeshResponse {
            message: message(),
            path,
            ..SaveMeshResponse::default()
        };
        let points = vec![Point::default(); 24];
        let found = TakeOutTouchResponse {
            message: message(),
            points,
            ..TakeOutTouchResponse::default()
        };
        let sizes = [
            ("detect_features", size(&detected)),
            ("take_out_touch", size(&found)),
            (
                "probe_feature",
                size(&ProbeFeatureResponse {
                    result: result(message()),
                }),
            ),
            (
                "probe: get_result",
                size(&GetResultResponse {
                    status: GoalStatusEnum::Succeeded,
                    result: ended,
                }),
            ),
            ("probe: cancel_goal", size(&cancelled)),
            (
                "probe: send_goal",
                size(&SendGoalResponse {
                    accepted: true,
                    stamp: Time::ZERO,
                }),
            ),
            ("save_mesh", size(&saved)),
            (
                "probe_all, arm_state, recover, reset",
                size(&TriggerResponse {
                    success: true,
                    message: message(),
                }),
            ),
        ];
        for (service, bytes) in sizes {
            println!("{bytes:5} bytes of {} {service}", room(TUNNEL));
            assert!(bytes <= room(TUNNEL), "{service}: {bytes} bytes");
        }
    }

    #[test]
    #[expect(clippy::too_many_lines)]
    fn a_text_that_is_too_long_is_cut_and_the_rest_of_the_answer_stays() {
        let answer = fits(TriggerResponse {
            success: true,
            message: long(),
        });
        assert!(answer.success && answer.message.ends_with(" …") && answer.message.len() > 1000);
        assert!(long().starts_with(answer.message.trim_end_matches(" …")));
        let answer = fits(SaveMeshResponse {
            success: true,
            message: long(),
            path: "a/path".to_owned(),
            face_count: 7,
            ..SaveMeshResponse::default()
        });
        assert_eq!(
            (answer.success, answer.path.as_str(), answer.face_count),
            (true, "a/path", 7)
        );
        let answer = fits(SaveMeshResponse {
            message: long(),
            path: long(),
            ..SaveMeshResponse::default()
        });
        assert!(answer.message.is_empty() && answer.path.ends_with(" …"));
        let answer = fits(ProbeFeatureResponse {
            result: ProbeResult {
                id: 3,
                code: 40,
                ..result(long())
            },
        });
        assert_eq!(
            (
                answer.result.id,
                answer.result.code,
                answer.result.feature.points.len()
            ),
            (3, 40, 2)
        );
        let answer = fits(GetResultResponse {
            status: GoalStatusEnum::Aborted,
            result: ProbeResponse {
                message: long(),
                ids: vec![5],
                codes: vec![40],
                ..ProbeResponse::default()
            },
        });
        assert_eq!(
            (answer.result.ids, answer.result.codes),
            (vec![5], vec![40])
        );
        fits(DetectFeaturesResponse {
            message: long(),
            ids: (0..128).collect(),
            ..DetectFeaturesResponse::default()
        });
        fits(ResyncMeshResponse {
            message: long(),
            ..ResyncMeshResponse::default()
        });
        fits(UndoResponse {
            message: long(),
            ..UndoResponse::default()
        });
        let points = vec![Point::default(); 24];
        let found = fits(TakeOutTouchResponse {
            message: long(),
            points,
            ..TakeOutTouchResponse::default()
        });
        assert_eq!(found.points.len(), 24);
        fits(FlagFeatureResponse {
            message: long(),
            ..FlagFeatureResponse::default()
        });
        fits(UnflagFeatureResponse {
            message: long(),
            success: true,
        });
        fits(SetBoolResponse {
            message: long(),
            success: true,
        });
        let refused = SetParametersResult {
            successful: false,
            reason: long(),
        };
        assert!(
            fits(SetParametersAtomicallyResponse { result: refused })
                .result
                .reason
                .ends_with(" …")
        );
    }

    #[test]
    fn of_too_many_parameters_the_answer_is_empty_and_keeps_what_was_set() {
        let value = || messages::ParameterValue {
            string_value: "a".repeat(100),
            ..Default::default()
        };
        assert!(
            fits(GetParametersResponse {
                values: vec![value(); 20]
            })
            .values
            .is_empty()
        );
        assert!(
            fits(GetParameterTypesResponse {
                types: vec![0; 2000]
            })
            .types
            .is_empty()
        );
        let names = vec!["a name of a parameter".to_owned(); 100];
        let list = ListParametersResponse {
            result: ListParametersResult {
                names,
                prefixes: Vec::new(),
            },
        };
        assert!(fits(list).result.names.is_empty());
        let set = |successful| SetParametersResult {
            successful,
            reason: "a".repeat(100),
        };
        let results = fits(SetParametersResponse {
            results: (0..20).map(|i| set(i % 2 == 0)).collect(),
        })
        .results;
        assert_eq!(
            results.iter().map(|one| one.successful).collect::<Vec<_>>(),
            [true, false].repeat(10)
        );
        assert!(
            fits(SetParametersResponse {
                results: vec![set(true); 1000]
            })
            .results
            .is_empty()
        );
    }

    #[test]
    fn values_that_ip_alone_parts_go_out_whole() {
        // on a cloud network, with the paths of a launch file
        let mut whole = all_values(&launched());
        assert!((room(1400) + 1..=1400 - 128).contains(&size(&whole)));
        whole.reduce(room(1400));
        assert_eq!(whole.values.len(), PARAMETERS.len());
    }

    #[test]
    fn the_mapping_of_cyclone_has_no_limit() {
        let whole = GetParameterTypesResponse {
            types: vec![0; 100_000],
        };
        let fit = |mapping| {
            Room::new(&mapping)
                .fit("~/get_parameter_types", whole.clone())
                .types
                .len()
        };
        assert_eq!(
            [ServiceMapping::Cyclone, ServiceMapping::Enhanced].map(fit),
            [100_000, 0]
        );
    }

    #[test]
    fn a_text_is_cut_between_its_letters() {
        for by in 0..40 {
            let mut text = "ØØØØØØØØØØ".to_owned();
            cut(&mut text, by);
            assert!(text.len() <= 20usize.saturating_sub(by), "{by}: {text}");
        }
    }

    fn names() -> Vec<String> {
        PARAMETERS
            .iter()
            .map(|declared| declared.name.to_owned())
            .collect()
    }

    /// Answer to the request of `ros2 param dump`.
    fn all_values(values: &Parameters) -> GetParametersResponse {
        get(values, &GetParametersRequest { names: names() })
    }

    fn described(names: Vec<String>) -> DescribeParametersResponse {
        describe_all(&DescribeParametersRequest { names })
    }

    /// Parameters of a launch file, with paths.
    fn launched() -> Parameters {
        let mut values = Parameters::default();
        let share = "/home/somebody/ws/install/touchup/share/touchup/config/probe.yaml";
        for (name, path) in [
            ("scene", share),
            ("scan", "/home/somebody/scans/part.ply"),
            ("tool_frame", "probe_tip"),
        ] {
            values
                .set(name, &ParameterValue::String(path.to_owned()))
                .unwrap();
        }
        values
    }

    #[test]
    #[expect(clippy::too_many_lines)]
    fn what_is_asked_of_all_parameters_fits_into_one_packet() {
        let mut described_briefly = described(names());
        described_briefly.reduce(room(ETHERNET));
        let types = GetParameterTypesResponse {
            types: vec![0; PARAMETERS.len()],
        };
        let live = PARAMETERS
            .iter()
            .filter(|declared| declared.settable != Settable::AtStart);
        let refused = |one: &ParameterDescriptor| {
            Parameters::default().set_live(one.name, &ParameterValue::Integer(-1))
        };
        let results = live
            .map(|one| set_result(refused(one).map_err(|why| why.to_string())))
            .collect();
        let sizes = [
            (
                "list_parameters",
                size(&list(&ListParametersRequest {
                    prefixes: Vec::new(),
                    depth: 0,
                })),
            ),
            (
                "get_parameters of all, as they are declared",
                size(&all_values(&Parameters::default())),
            ),
            (
                "get_parameters of all, with paths",
                size(&all_values(&launched())),
            ),
            ("get_parameter_types of all", size(&types)),
            (
                "describe_parameters of all, without descriptions",
                size(&described_briefly),
            ),
            (
                "set_parameters of all that are live, refused",
                size(&SetParametersResponse { results }),
            ),
        ];
        println!(
            "{} parameters; described in full: {} bytes",
            PARAMETERS.len(),
            size(&described(names()))
        );
        for (service, bytes) in sizes {
            println!("{bytes:5} bytes of {} {service}", room(ETHERNET));
            assert!(bytes <= room(ETHERNET), "{service}: {bytes} bytes");
        }
        // even with smaller packets, as on a cloud network, names, types and ranges remain
        let mut without_words = described(names());
        without_words.reduce(room(1400));
        assert_eq!(without_words.descriptors.len(), PARAMETERS.len());
        // only the descriptions are missing
        let of = |one: &messages::ParameterDescriptor| {
            (
                one.name.clone(),
                one.r#type,
                one.additional_constraints.clone(),
            )
        };
        assert_eq!(
            described_briefly
                .descriptors
                .iter()
                .map(of)
                .collect::<Vec<_>>(),
            described(names())
                .descriptors
                .iter()
                .map(of)
                .collect::<Vec<_>>()
        );
        assert!(
            described_briefly
                .descriptors
                .iter()
                .all(|one| one.description.is_empty())
        );
    }

    #[test]
    fn a_few_parameters_are_described_in_full() {
        let names = names();
        let largest = names.windows(8).map(|few| size(&described(few.to_vec())));
        let largest = largest.max().unwrap();
        println!("{largest} bytes of {}", room(ETHERNET));
        assert!(largest <= room(ETHERNET));
    }
}
