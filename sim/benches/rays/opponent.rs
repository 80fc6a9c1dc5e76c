//! Rapier on the same orchard: a collider per tree, the trees of one kind sharing a mesh, and its query pipeline.
//!
//! The workspace has rapier in double precision; `tools/compare_embree.py` times the single-precision one.

use super::scene::Orchard;
use arborloop_sim::optics::Ray;
use rapier3d_f64::prelude::*;

pub(crate) struct Rapier {
    world: PhysicsWorld,
}

impl Rapier {
    pub(crate) fn new(orchard: &Orchard) -> Self {
        let mut world = PhysicsWorld::new();
        let mesh = |vertices: Vec<Vector>, triangles: Vec<[u32; 3]>| {
            SharedShape::trimesh(vertices, triangles).expect("a mesh with triangles")
        };
        let (vertices, triangles) = super::export::soil(orchard);
        let point = |p: &[f32; 3]| Vector::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        world.insert_collider(
            ColliderBuilder::new(mesh(vertices.iter().map(point).collect(), triangles)),
            None,
        );
        for plant in &orchard.world.plants {
            // A shape has no scale of its own, so each tree has its mesh: more memory, the same work per ray.
            let (vertices, triangles) = super::export::tree(orchard, plant.prototype);
            let scale = plant.world_from_plant.scaling();
            let scaled = vertices.iter().map(|p| point(p) * scale).collect();
            let pose = plant.world_from_plant.isometry.into();
            world.insert_collider(ColliderBuilder::new(mesh(scaled, triangles)).position(pose), None);
        }
        world.detect_collisions(&(), &());
        Rapier { world }
    }

    /// Distances, for the timing only.
    pub(crate) fn cast_all(&self, rays: &[Ray]) -> f64 {
        let pipeline = self.world.query_pipeline_with_filter(QueryFilter::default());
        let cast = |ray: &Ray| {
            let beam = rapier3d_f64::prelude::Ray::new(
                Vector::new(ray.origin.x, ray.origin.y, ray.origin.z),
                Vector::new(ray.direction.x, ray.direction.y, ray.direction.z),
            );
            pipeline.cast_ray(&beam, ray.range_m_max, true).map_or(0.0, |(_, range_m)| range_m)
        };
        std::hint::black_box(rays.iter().map(cast).sum())
    }
}
