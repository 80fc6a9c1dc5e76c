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
    /// What there is to be carried has no weight, or one beyond numbers.
    #[error("robot \"{robot}\" weighs {found} kg, wanted more than nothing and a finite number")]
    Mass {
        /// The robot.
        robot: String,
        /// Its mass.
        found: String,
    },
    /// A leg's joint turns about another axis than the controller counts on.
    #[error("robot \"{robot}\" has joint \"{joint}\" turning about ({found}) in its base, wanted {wanted}")]
    Axis {
        /// The robot.
        robot: String,
        /// The joint.
        joint: String,
        /// Its axis.
        found: String,
        /// The axis wanted.
        wanted: &'static str,
    },
    /// The standing pose is out of a joint's limits.
    #[error(
        "robot \"{robot}\" cannot stand: joint \"{joint}\" goes from {low} to {high} rad, wanted {wanted} rad inside"
    )]
    Stance {
        /// The robot.
        robot: String,
        /// The joint.
        joint: String,
        /// Its lowest angle, radians.
        low: String,
        /// Its highest angle, radians.
        high: String,
        /// The angle of the stance, radians.
        wanted: String,
    },
}
