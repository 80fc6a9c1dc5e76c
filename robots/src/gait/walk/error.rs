//! Why a described robot cannot walk by this controller.

/// Something that a walking body needs is missing from a robot's description.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BodyError {
    /// A leg's joint is missing or does not turn.
    #[error("robot \"{robot}\" has no revolute joint \"{joint}\", wanted hip, thigh and calf of each leg")]
    NoJoint {
        /// The robot.
        robot: String,
        /// The joint wanted.
        joint: String,
    },
    /// A leg's foot is missing.
    #[error(
        "robot \"{robot}\" has no link \"{foot}\" below joint \"{calf}\", wanted a foot at each leg's end"
    )]
    NoFoot {
        /// The robot.
        robot: String,
        /// The link wanted.
        foot: String,
        /// The leg's last joint.
        calf: String,
    },
}
