//! What touches what, and how hard.

use crate::demo::Contacts;
use crate::robot::Robot;
use crate::task::MOST_OBJECTS;
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::prelude::{Collider, ContactPair, PhysicsWorld, Pose};

/// Surfaces this near touch although no force was exchanged yet \[m\] (a world that was just set).
const TOUCH_M: f32 = 1e-4;
/// Nothing that is farther from the robot comes to it within a control step \[m\]: 36 deg/s on a lever of 0.9 m make 3 cm.
const NEAR_M: f32 = 0.04;

/// Whom a collider belongs to; kept in rapier's user data, so that a snapshot carries it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Table,
    Obstacle,
    /// An object of the task, by its place there.
    Object(usize),
    /// A link of the robot, by index.
    Link(usize),
}

/// User data of the first object; the others follow.
const FIRST_OBJECT_CODE: u128 = 2;
/// User data of link 0; the others follow.
const FIRST_LINK_CODE: u128 = FIRST_OBJECT_CODE + MOST_OBJECTS as u128;

impl Owner {
    pub(super) fn code(self) -> u128 {
        match self {
            Owner::Table => 0,
            Owner::Obstacle => 1,
            Owner::Object(i) => FIRST_OBJECT_CODE + i as u128,
            Owner::Link(i) => FIRST_LINK_CODE + i as u128,
        }
    }

    fn of(collider: &Collider) -> Self {
        match collider.user_data {
            0 => Owner::Table,
            1 => Owner::Obstacle,
            link @ FIRST_LINK_CODE.. => Owner::Link((link - FIRST_LINK_CODE) as usize),
            object => Owner::Object((object - FIRST_OBJECT_CODE) as usize),
        }
    }
}

/// Reads all contacts of the last physics step, in a task of so many objects.
pub(super) fn read(physics: &PhysicsWorld, robot: &Robot, objects: usize) -> Contacts {
    let (mut contacts, hand) = (Contacts::none(robot.fingers().len(), objects), robot.hand());
    for pair in physics.contact_pairs() {
        let [one, other] = [pair.collider1, pair.collider2].map(|h| &physics.colliders[h]);
        if force_n(pair, physics) <= 0.0 && separation(pair, one.position(), other.position()) > TOUCH_M {
            continue;
        }
        match ordered(Owner::of(one), Owner::of(other)) {
            (Owner::Link(link), Owner::Object(object)) if link > hand => {
                contacts.objects[object].fingers_n[link - hand - 1] += force_n(pair, physics)
            }
            (Owner::Link(_), Owner::Obstacle) => contacts.robot_obstacle = true,
            (Owner::Link(_), Owner::Table) => contacts.robot_table = true,
            (Owner::Object(object), Owner::Table) => contacts.objects[object].table = true,
            (Owner::Object(one), Owner::Object(other)) => {
                contacts.objects[one].objects.insert(other);
                contacts.objects[other].objects.insert(one);
            }
            _ => {}
        }
    }
    contacts
}

/// Whether something comes near the moving part of the robot, by boxes around both.
pub(super) fn robot_near(physics: &PhysicsWorld) -> bool {
    let all = || physics.colliders.iter().map(|(_, collider)| (Owner::of(collider), collider));
    let others = || all().filter(|(owner, _)| !matches!(owner, Owner::Link(_)));
    let links = all().filter(|(owner, _)| matches!(owner, Owner::Link(1..)));
    links.map(|(_, link)| link.compute_aabb().loosened(NEAR_M)).any(|b| others().any(|(_, o)| b.intersects(&o.compute_aabb())))
}

/// Normal force of the pair, mean over the last physics step \[N\].
pub(super) fn force_n(pair: &ContactPair, physics: &PhysicsWorld) -> f64 {
    f64::from(pair.total_impulse_magnitude() / physics.integration_parameters.dt)
}

/// Links first, then objects, then what stands still.
fn ordered(one: Owner, other: Owner) -> (Owner, Owner) {
    let rank = |o: Owner| match o {
        Owner::Link(_) => 0,
        Owner::Object(_) => 1,
        _ => 2,
    };
    if rank(one) <= rank(other) { (one, other) } else { (other, one) }
}

/// Distance of the surfaces now \[m\]: rapier keeps the contact points of a pair that hardly moved, so its own figure may be old.
fn separation(pair: &ContactPair, one: &Pose, other: &Pose) -> f32 {
    let points = pair.manifolds().iter().flat_map(|m| m.points.iter().map(move |p| (m, p)));
    points.fold(f32::INFINITY, |least, (manifold, point)| {
        let gap = (*other * point.local_p2) - (*one * point.local_p1);
        least.min(gap.dot(one.rotation * manifold.local_n1))
    })
}
