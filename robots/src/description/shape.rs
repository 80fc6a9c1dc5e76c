//! The shapes of links, and the box that weighs and turns as a link does, for shapes that are drawn by meshes.

use super::{Link, Robot};
use arborloop_base::Pose;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// What it is.
    pub form: Form,
    /// Its middle and axes in the link's frame.
    pub link_from_shape: Pose,
}

/// Forms that URDF knows. Cylinders stand along z.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A box.
    Box {
        /// Length, width and height, meters.
        size_m: Vector3<f64>,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius, meters.
        radius_m: f64,
        /// Length, meters.
        length_m: f64,
    },
    /// A ball.
    Sphere {
        /// Radius, meters.
        radius_m: f64,
    },
    /// A mesh, named and not opened.
    Mesh {
        /// As the file names it, for instance `package://a1_description/meshes/trunk.dae`.
        file: String,
    },
}

impl Link {
    /// The uniform box with the link's mass and inertia; `None` for a link without mass, or with an inertia that no
    /// box has.
    pub fn inertial_box(&self) -> Option<Shape> {
        if self.mass_kg <= 0.0 {
            return None;
        }
        let eigen = self.inertia_kgm2.symmetric_eigen();
        let [x, y, z] = [0, 1, 2].map(|axis| eigen.eigenvalues[axis]);
        // Of a box m/12 (b2 + c2) about the axis along a: solved for the sides.
        let squares = Vector3::new(y + z - x, x + z - y, x + y - z) * 6.0 / self.mass_kg;
        if !squares.iter().all(|square| square.is_finite() && *square > 0.0) {
            return None;
        }
        let mut axes: Matrix3<f64> = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Some(Shape {
            form: Form::Box { size_m: squares.map(f64::sqrt) },
            link_from_shape: Pose::from_parts(self.center_of_mass.coords.into(), turn),
        })
    }
}

impl Robot {
    /// Puts the inertial box of its link in place of every mesh that `known` does not know; one sentence for each.
    pub fn box_meshes(&mut self, known: &dyn Fn(&str) -> bool) -> Vec<String> {
        let mut notes = Vec::new();
        for link in &mut self.links {
            let substitute = link.inertial_box();
            let (mut kept, mut boxed) = (Vec::new(), None);
            for shape in std::mem::take(&mut link.shapes) {
                match &shape.form {
                    Form::Mesh { file } if !known(file) => boxed = Some(file.clone()),
                    _ => kept.push(shape),
                }
            }
            link.shapes = kept;
            let Some(file) = boxed else { continue };
            let (line, name) = (link.line, &link.name);
            notes.push(match &substitute {
                Some(Shape { form: Form::Box { size_m }, .. }) => format!(
                    "line {line}: link \"{name}\" is drawn by {file}, which was not found: a box of its mass and inertia \
                     stands for it, {:.3} x {:.3} x {:.3} m",
                    size_m.x, size_m.y, size_m.z
                ),
                _ => format!(
                    "line {line}: link \"{name}\" is drawn by {file}, which was not found, and has no mass to make a box of: \
                     it touches nothing"
                ),
            });
            link.shapes.extend(substitute);
        }
        notes
    }
}

#[cfg(test)]
mod tests {
    use crate::{Form, Lump, Robot};
    use nalgebra::Point3;

    #[test]
    fn the_inertial_box_of_a_box_is_that_box() {
        let text = r#"<robot name="r"><link name="a"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
            <inertia ixx="0.0325" iyy="0.0725" izz="0.085" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
        let robot = Robot::from_urdf(text, "box.urdf").unwrap();
        let shape = robot.links[0].inertial_box().unwrap();
        // 3 kg, 0.5 x 0.3 x 0.2 m: m/12 (b2 + c2) about each axis, in some order of its axes.
        let Form::Box { size_m } = shape.form else { panic!("{shape:?}") };
        let again = Lump::cuboid(3.0, Point3::origin(), size_m).seen_from(&shape.link_from_shape);
        assert!((again.inertia_kgm2 - robot.links[0].inertia_kgm2).norm() < 1e-12, "{again:?}");
        assert!((again.center_of_mass - Point3::new(0.1, 0.0, 0.2)).norm() < 1e-12);
        let mut sides: Vec<f64> = size_m.iter().copied().collect();
        sides.sort_by(f64::total_cmp);
        assert!((sides[0] - 0.2).abs() < 1e-9 && (sides[2] - 0.5).abs() < 1e-9, "{sides:?}");
    }
}
