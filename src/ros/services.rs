//! The services of docs/ros.md, but for those of parameters and the action.

use std::sync::Arc;

use super::exchange::{Exchange, RosError};
use super::messages::*;
use super::port::{Arrival, Call, Reply};

/// A back end that offers services of one type.
pub(super) trait Serves<S: RosService> {
    /// Has `call` answer what is asked.
    fn serve(
        &mut self,
        name: &'static str,
        call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError>;
}

macro_rules! services {
    ($($name:literal: $service:ident, $call:expr;)+) => {
        /// Offers all; what is asked goes to the inbox of the node.
        pub(super) fn serve<B>(back_end: &mut B, exchange: &Arc<Exchange>) -> Result<(), RosError>
        where
            $(B: Serves<$service>,)+
        {
            $(let to = exchange.clone();
            <B as Serves<$service>>::serve(back_end, $name, move |request, reply| {
                to.arrivals.put(Arrival::Call($call(request, reply)));
            })?;)+
            Ok(())
        }
    };
}

services! {
    "~/flag_feature": FlagFeature, Call::Flag;
    "~/unflag_feature": UnflagFeature, Call::Unflag;
    "~/detect_features": DetectFeatures, Call::Detect;
    "~/save_mesh": SaveMesh, Call::Save;
    "~/resync_mesh": ResyncMesh, Call::Resync;
    "~/undo": Undo, Call::Undo;
    "~/redo": Undo, Call::Redo;
    "~/reset": Trigger, |_, reply| Call::Reset(reply);
    "~/pause": SetBool, Call::Pause;
    "~/probe_all": Trigger, |_, reply| Call::ProbeAll(reply);
    "~/recover": Trigger, |_, reply| Call::Recover(reply);
    "~/arm_state": Trigger, |_, reply| Call::ArmState(reply);
    "~/probe_feature": ProbeFeature, Call::ProbeFeature;
}

/// The action.
pub(super) const PROBE: &str = "~/probe";

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    /// What stands between `before` and `after`, each time.
    fn between<'a>(text: &'a str, before: &'a str, after: char) -> BTreeSet<&'a str> {
        text.split(before).skip(1).filter_map(|rest| rest.split_once(after)).map(|(name, _)| name).collect()
    }

    #[test]
    fn the_services_are_those_of_the_documentation() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/ros.md")).unwrap();
        let (code, _) = include_str!("services.rs").split_once("#[cfg(test)]").unwrap();
        assert_eq!(between(code, "\"~/", '"'), between(&text, "\n| `~/", '`'));
    }
}
