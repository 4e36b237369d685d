//! Environment variables that other ROS nodes heed and this back end does not.

use crate::ros::exchange::RosError;

/// Distributions whose nodes identify readers and writers by 24 bytes, not by 16.
const OLD: [&str; 6] = [
    "humble", "galactic", "foxy", "eloquent", "dashing", "crystal",
];
/// Distributions known to work with the node.
const KNOWN: [&str; 5] = ["iron", "jazzy", "kilted", "lyrical", "rolling"];

/// Whether the environment requests security: any value except empty, 0 and false, as for
/// [`unheeded`].
fn is_secured(variable: &impl Fn(&str) -> Option<String>) -> bool {
    variable("ROS_SECURITY_ENABLE")
        .is_some_and(|value| !["", "0", "false"].contains(&value.to_lowercase().as_str()))
}

/// Refuses an environment in which a node of this back end must not run, or would be invisible.
///
/// - `variable`: of the environment.
///
/// # Errors
/// [`RosError::Refused`], with the variable.
pub(super) fn check(variable: impl Fn(&str) -> Option<String>) -> Result<(), RosError> {
    let is = |name: &str, value: &str| {
        variable(name).is_some_and(|given| given.eq_ignore_ascii_case(value))
    };
    let refused = |reason: String, remedy| {
        let call = "joining the domain";
        Err(RosError::Refused {
            call,
            reason,
            remedy,
        })
    };
    if is_secured(&variable) && is("ROS_SECURITY_STRATEGY", "Enforce") {
        let reason = "ROS_SECURITY_ENABLE and ROS_SECURITY_STRATEGY=Enforce ask for encryption and access control, which this \
                      node does not have";
        let remedy =
            "unset them where the network can be trusted, or build the node with the feature r2r";
        return refused(reason.to_owned(), remedy);
    }
    if let Some(old) = OLD.iter().find(|old| is("ROS_DISTRO", old)) {
        let reason = format!(
            "nodes of ROS_DISTRO={old} name each other otherwise and do not see this node in the graph"
        );
        let remedy = "use Iron or later, or build the node with the feature r2r, or unset ROS_DISTRO where topics and services are enough";
        return refused(reason, remedy);
    }
    Ok(())
}

/// One sentence for each set variable.
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
    let unknown = unknown.into_iter().filter_map(&set).map(|(name, value)| {
        format!(
            "{name}={value} is not heeded: other nodes are found by multicast alone; build the node with the feature r2r \
             where that does not do"
        )
    });
    let security = is_secured(&variable).then(|| {
        "ROS_SECURITY_ENABLE is not heeded: the node speaks without encryption, and anybody on the network may speak to it".to_owned()
    });
    let distribution = set("ROS_DISTRO")
        .filter(|(_, value)| !KNOWN.contains(&value.as_str()))
        .map(|(name, value)| {
            format!(
                "{name}={value} is not known: the node speaks as {} do",
                KNOWN.join(", ")
            )
        });
    let others = security.into_iter().chain(distribution);
    rmw.into_iter().chain(unknown).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An environment with these variables alone.
    fn environment<'a>(set: &'a [(&str, &str)]) -> impl Fn(&str) -> Option<String> + 'a {
        move |name| {
            let found = set.iter().find(|(set, _)| *set == name);
            found.map(|(_, value)| (*value).to_owned())
        }
    }

    #[test]
    fn enforced_security_and_old_distributions_are_refused_and_no_others() {
        let (enable, strategy) = ("ROS_SECURITY_ENABLE", "ROS_SECURITY_STRATEGY");
        for value in ["true", "True", "1"] {
            let refused = check(environment(&[(enable, value), (strategy, "Enforce")]));
            assert!(refused.unwrap_err().to_string().contains("Enforce"));
            for permissive in [
                &[(enable, value)][..],
                &[(enable, value), (strategy, "Permissive")],
            ] {
                assert!(check(environment(permissive)).is_ok());
                let said = unheeded(environment(permissive));
                assert!(
                    said.len() == 1 && said[0].contains("encryption"),
                    "{said:?}"
                );
            }
        }
        for set in [
            &[(enable, "false"), (strategy, "Enforce")][..],
            &[(strategy, "Enforce")],
        ] {
            assert!(check(environment(set)).is_ok() && unheeded(environment(set)).is_empty());
        }
        for distribution in ["jazzy", "kilted", "lyrical", "rolling", ""] {
            let set = [("ROS_DISTRO", distribution)];
            assert!(check(environment(&set)).is_ok() && unheeded(environment(&set)).is_empty());
        }
        assert_eq!(unheeded(environment(&[("ROS_DISTRO", "mellow")])).len(), 1);
        let refused = check(environment(&[("ROS_DISTRO", "humble")])).unwrap_err();
        assert!(refused.to_string().contains("ROS_DISTRO=humble"));
    }

    #[test]
    fn each_that_is_set_is_said_once_with_what_to_do() {
        let of = |set: &[(&str, &str)]| unheeded(environment(set));
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
