//! Names of ROS: relative, private (`~/x`) and absolute ones, and their remappings.

use thiserror::Error;

/// Reason why a name is invalid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NameError {
    /// an empty name, a slash at its end, or two adjacent slashes
    #[error("\"{0}\" has an empty part: a name is words between single slashes")]
    EmptyPart(String),
    /// a part that begins with a digit or has a sign other than letters, digits and _
    #[error(
        "\"{name}\" has the part \"{part}\": letters, digits and single _ are allowed, no digit at the beginning"
    )]
    BadPart {
        /// whole name
        name: String,
        /// invalid part
        part: String,
    },
}

/// One rule: uses of the first name become the second.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remap {
    /// as written
    pub from: String,
    /// as written
    pub to: String,
}

/// A node's place in the graph, the base of its relative names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GraphPlace {
    /// absolute, without a final slash; empty for the root
    pub namespace: String,
    /// one word
    pub node: String,
}

impl GraphPlace {
    /// The node's own full name.
    pub fn full_name(&self) -> String {
        format!("{}/{}", self.namespace, self.node)
    }

    /// The absolute form of a name.
    ///
    /// # Errors
    /// [`NameError`] for an invalid result.
    pub fn expand(&self, name: &str) -> Result<String, NameError> {
        let name = name.replace("{node}", &self.node);
        let name = name
            .replace("{ns}", &self.namespace)
            .replace("{namespace}", &self.namespace);
        let whole = match name.strip_prefix('~') {
            Some("") => self.full_name(),
            Some(own) if own.starts_with('/') => self.full_name() + own,
            _ if name.starts_with('/') => name,
            _ => format!("{}/{name}", self.namespace),
        };
        checked(whole)
    }

    /// The absolute form of a name after the first matching rule.
    ///
    /// # Errors
    /// [`NameError`] in the name or in a rule.
    pub fn resolve(&self, name: &str, rules: &[Remap]) -> Result<String, NameError> {
        let whole = self.expand(name)?;
        for rule in rules {
            if self.expand(&rule.from)? == whole {
                return self.expand(&rule.to);
            }
        }
        Ok(whole)
    }
}

/// Checks an absolute name.
pub(super) fn checked(whole: String) -> Result<String, NameError> {
    let Some(parts) = whole.strip_prefix('/') else {
        return Err(NameError::EmptyPart(whole));
    };
    for part in parts.split('/') {
        if part.is_empty() {
            return Err(NameError::EmptyPart(whole));
        }
        let is_word = part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_word || part.starts_with(|c: char| c.is_ascii_digit()) || part.contains("__") {
            return Err(NameError::BadPart {
                part: part.to_owned(),
                name: whole,
            });
        }
    }
    Ok(whole)
}

/// Whether a node pattern of a parameter file matches: `*` is one part, `**` any number of parts.
pub(super) fn matches(pattern: &str, full_name: &str) -> bool {
    fn fits(pattern: &[&str], name: &[&str]) -> bool {
        match (pattern.split_first(), name.split_first()) {
            (None, None) => true,
            (Some((&"**", rest)), _) => {
                (0..=name.len()).any(|skipped| fits(rest, &name[skipped..]))
            }
            (Some((&part, rest)), Some((&word, others))) => {
                (part == "*" || part == word) && fits(rest, others)
            }
            _ => false,
        }
    }
    let mut pattern: Vec<&str> = pattern.split('/').filter(|part| !part.is_empty()).collect();
    // two adjacent ones match the same, and slowly
    pattern.dedup_by(|a, b| *a == "**" && *b == "**");
    let name: Vec<&str> = full_name
        .split('/')
        .filter(|part| !part.is_empty())
        .collect();
    fits(&pattern, &name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(namespace: &str) -> GraphPlace {
        GraphPlace {
            namespace: namespace.into(),
            node: "touchup".into(),
        }
    }

    #[test]
    fn names_expand_as_the_design_of_ros_says() {
        let cases = [
            ("", "mesh", "/mesh"),
            ("/bench", "mesh", "/bench/mesh"),
            ("/bench", "stylus/wrench", "/bench/stylus/wrench"),
            ("/bench", "~/save_mesh", "/bench/touchup/save_mesh"),
            ("/bench", "~", "/bench/touchup"),
            ("/bench", "/tf", "/tf"),
            ("/a/b", "{node}/x", "/a/b/touchup/x"),
        ];
        for (namespace, name, whole) in cases {
            assert_eq!(
                place(namespace).expand(name).unwrap(),
                whole,
                "{namespace} {name}"
            );
        }
        for bad in ["", "/", "a//b", "a/", "~x", "1a", "a b", "a__b", "{x}"] {
            assert!(place("").expand(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_first_rule_that_fits_is_taken() {
        let rule = |from: &str, to: &str| Remap {
            from: from.into(),
            to: to.into(),
        };
        let rules = [
            rule("stylus/wrench", "/ft/wrench"),
            rule("/bench/mesh", "view/mesh"),
            rule("mesh", "never"),
        ];
        let place = place("/bench");
        assert_eq!(
            place.resolve("stylus/wrench", &rules).unwrap(),
            "/ft/wrench"
        );
        assert_eq!(place.resolve("mesh", &rules).unwrap(), "/bench/view/mesh");
        assert_eq!(place.resolve("tip", &rules).unwrap(), "/bench/tip");
    }

    #[test]
    fn patterns_of_parameter_files_name_nodes() {
        let cases = [
            ("/**", "/touchup", true),
            ("/**", "/a/b/touchup", true),
            ("touchup", "/touchup", true),
            ("touchup", "/bench/touchup", false),
            ("/bench/touchup", "/bench/touchup", true),
            ("/*/touchup", "/bench/touchup", true),
            ("/*/touchup", "/touchup", false),
            ("/**/touchup", "/a/b/touchup", true),
            ("/**/touchup", "/a/b/other", false),
            ("/bench/**", "/bench/touchup", true),
        ];
        for (pattern, name, fits) in cases {
            assert_eq!(matches(pattern, name), fits, "{pattern} {name}");
        }
    }
}
