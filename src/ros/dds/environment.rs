//! Variables of the environment that other ROS nodes heed and this back end does not.

/// One sentence for each that is set.
///
/// - `variable`: of the environment.
pub(super) fn unheeded(variable: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let set = |name: &str| {
        variable(name)
            .filter(|value| !value.is_empty())
            .map(|value| (name.to_owned(), value))
    };
    let rmw = set("RMW_IMPLEMENTATION").map(|(name, value)| match value.as_str() {
        "rmw_fastrtps_cpp" | "rmw_fastrtps_dynamic_cpp" | "rmw_cyclonedds_cpp" => {
            format!("{name}={value} is not heeded: the node speaks DDS by itself, and meets nodes of {value}")
        }
        _ => format!(
            "{name}={value} is not heeded: the node speaks DDS, and meets nodes of Fast DDS and Cyclone DDS alone; \
             build it with the feature r2r for others"
        ),
    });
    let unknown = [
        "ROS_STATIC_PEERS",
        "ROS_DISCOVERY_SERVER",
        "CYCLONEDDS_URI",
        "FASTRTPS_DEFAULT_PROFILES_FILE",
    ];
    let unknown = unknown.into_iter().filter_map(set).map(|(name, value)| {
        format!(
            "{name}={value} is not heeded: other nodes are found by multicast alone; build the node with the feature r2r \
             where that does not do"
        )
    });
    rmw.into_iter().chain(unknown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_that_is_set_is_said_once_with_what_to_do() {
        let of = |set: &[(&str, &str)]| {
            let set: Vec<_> = set
                .iter()
                .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
                .collect();
            unheeded(move |name| {
                set.iter()
                    .find(|(set, _)| set == name)
                    .map(|(_, value)| value.clone())
            })
        };
        assert_eq!(
            of(&[("ROS_DOMAIN_ID", "3"), ("ROS_STATIC_PEERS", "")]),
            Vec::<String>::new()
        );
        let said = of(&[
            ("ROS_STATIC_PEERS", "10.0.0.7"),
            ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
        ]);
        assert!(
            said.len() == 2 && said[0].contains("rmw_zenoh_cpp") && said[1].contains("10.0.0.7"),
            "{said:?}"
        );
        assert!(said.iter().all(|line| line.contains("r2r")), "{said:?}");
        let cyclone = of(&[("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")]);
        assert!(
            cyclone[0].contains("meets nodes of rmw_cyclonedds_cpp"),
            "{cyclone:?}"
        );
    }
}
