//! The eye that goes around the curtain: orbit, pan and zoom, kept inside the room.

use glam::{Vec2, Vec3};
use woven_render::scene::Camera;

/// Greatest yaw and pitch [rad]: beyond them the eye would look along the window wall or stand on its head.
const YAW_LIMIT: f32 = 1.45;
/// See [`YAW_LIMIT`].
const PITCH_LIMIT: f32 = 1.45;
/// Least and greatest distance from the target [m].
const DISTANCE: (f32, f32) = (0.25, 12.0);
/// The eye and its target keep this distance from the walls [m].
const MARGIN: f32 = 0.08;

/// A camera that looks at `target` from a distance and two angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// The point looked at [m].
    pub target: Vec3,
    /// Distance of the eye from it [m].
    pub distance: f32,
    /// Angle about +Y, 0 along +Z, positive to the right [rad].
    pub yaw: f32,
    /// Angle above the horizontal [rad].
    pub pitch: f32,
    /// Full vertical angle of view [rad].
    pub vfov: f32,
    /// The room: lower and upper corner [m].
    pub room: (Vec3, Vec3),
}

impl Orbit {
    /// The orbit that sees what `camera` sees, within `room`.
    #[must_use]
    pub fn of(camera: &Camera, room: (Vec3, Vec3)) -> Self {
        let eye = camera.transform.w_axis.truncate();
        let ahead = -camera.transform.z_axis.truncate();
        let back = -ahead;
        let distance = camera.focus_distance;
        let orbit = Self {
            target: eye + ahead * distance,
            distance,
            yaw: back.x.atan2(back.z),
            pitch: back.y.clamp(-1.0, 1.0).asin(),
            vfov: camera.vfov,
            room,
        };
        orbit.kept_inside()
    }

    /// Unit vector from the target to the eye.
    #[must_use]
    pub fn back(&self) -> Vec3 {
        let (sin, cos) = self.yaw.sin_cos();
        let (up, flat) = self.pitch.sin_cos();
        Vec3::new(sin * flat, up, cos * flat)
    }

    /// Place of the eye [m].
    #[must_use]
    pub fn eye(&self) -> Vec3 {
        self.target + self.back() * self.distance
    }

    /// The renderer's camera.
    #[must_use]
    pub fn camera(&self, exposure: f32) -> Camera {
        Camera {
            exposure,
            ..Camera::look_at(self.eye(), self.target, Vec3::Y, self.vfov)
        }
    }

    /// Turns by a drag of `pixels` in a picture `height` pixels high: half a turn a height; the curtain follows the pointer.
    #[must_use]
    pub fn orbit(mut self, pixels: Vec2, height: f32) -> Self {
        let angle = pixels * (std::f32::consts::PI / height.max(1.0));
        self.yaw = (self.yaw - angle.x).clamp(-YAW_LIMIT, YAW_LIMIT);
        self.pitch = (self.pitch + angle.y).clamp(-PITCH_LIMIT, PITCH_LIMIT);
        self.kept_inside()
    }

    /// Moves sideways by a drag of `pixels`: the point under the pointer at the target's distance stays under it.
    #[must_use]
    pub fn pan(mut self, pixels: Vec2, height: f32) -> Self {
        let metres = pixels * (2.0 * self.distance * (self.vfov * 0.5).tan() / height.max(1.0));
        let camera = self.camera(0.0).transform;
        let right = camera.x_axis.truncate();
        let up = camera.y_axis.truncate();
        self.target += up * metres.y - right * metres.x;
        self.kept_inside()
    }

    /// Comes nearer (`factor` < 1) or goes away.
    #[must_use]
    pub fn zoom(mut self, factor: f32) -> Self {
        self.distance = (self.distance * factor).clamp(DISTANCE.0, DISTANCE.1);
        self.kept_inside()
    }

    /// The target put into the room, and the eye drawn towards it until it is inside, too.
    fn kept_inside(mut self) -> Self {
        let (low, high) = (self.room.0 + MARGIN, self.room.1 - MARGIN);
        self.target = self.target.clamp(low, high);
        let back = self.back();
        let mut free = self.distance;
        for axis in 0..3 {
            let wall = if back[axis] > 0.0 {
                high[axis]
            } else {
                low[axis]
            };
            // A wall parallel to the view is never reached.
            if back[axis].abs() > 1e-6 {
                free = free.min((wall - self.target[axis]) / back[axis]);
            }
        }
        self.distance = free.max(1e-3);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: (Vec3, Vec3) = (Vec3::new(-2.0, 0.0, 0.0), Vec3::new(2.0, 2.6, 4.5));

    fn start() -> Orbit {
        let eye = Vec3::new(0.4, 1.3, 4.2);
        Orbit::of(
            &Camera::look_at(eye, Vec3::new(0.0, 1.2, 0.2), Vec3::Y, 0.6),
            ROOM,
        )
    }

    /// Where a world point lies in a picture `height` high and as wide, in pixels from the middle, x right, y down.
    fn project(orbit: &Orbit, point: Vec3, height: f32) -> Vec2 {
        let p = orbit
            .camera(0.0)
            .transform
            .inverse()
            .transform_point3(point);
        Vec2::new(p.x, -p.y) / -p.z * (height * 0.5 / (orbit.vfov * 0.5).tan())
    }

    #[test]
    fn an_orbit_sees_what_its_camera_saw() {
        let eye = Vec3::new(0.4, 1.3, 4.2);
        let camera = Camera::look_at(eye, Vec3::new(0.0, 1.2, 0.2), Vec3::Y, 0.6);
        let again = Orbit::of(&camera, ROOM).camera(0.0);
        for (a, b) in camera
            .transform
            .to_cols_array()
            .iter()
            .zip(again.transform.to_cols_array())
        {
            // Through an arctangent and an arcsine and back in f32.
            assert!((a - b).abs() < 2e-6, "{a} {b}");
        }
    }

    #[test]
    fn turning_keeps_the_target_and_its_distance() {
        let before = Orbit {
            distance: 1.5,
            ..start()
        };
        let after = before.orbit(Vec2::new(40.0, -15.0), 600.0);
        assert_eq!(after.target, before.target);
        assert!((after.eye().distance(after.target) - 1.5).abs() < 1e-5);
        assert!((before.yaw - after.yaw - 40.0 / 600.0 * std::f32::consts::PI).abs() < 1e-6);
        assert!(project(&after, after.target, 600.0).length() < 1e-2);
    }

    #[test]
    fn what_is_under_the_pointer_follows_it() {
        let orbit = start();
        let drag = Vec2::new(30.0, -12.0);
        let after = orbit.pan(drag, 600.0);
        let moved = project(&after, orbit.target, 600.0);
        assert!((moved - drag).length() < 0.02, "{moved}");
        // Turning to the right makes the near side, hence what is in front of the target, move to the right.
        let near = orbit.target + orbit.back() * 0.5;
        let turned = orbit.orbit(Vec2::new(30.0, 0.0), 600.0);
        assert!(project(&turned, near, 600.0).x > 0.0);
    }

    #[test]
    fn the_eye_stays_in_the_room_whatever_is_dragged() {
        let mut orbit = start();
        for i in 0..500 {
            let a = i as f32;
            orbit = orbit.orbit(
                Vec2::new((a * 0.7).sin() * 90.0, (a * 1.3).cos() * 70.0),
                600.0,
            );
            orbit = orbit.pan(
                Vec2::new((a * 0.3).cos() * 60.0, (a * 0.9).sin() * 50.0),
                600.0,
            );
            orbit = orbit.zoom(1.0 + 0.4 * (a * 0.21).sin());
            for p in [orbit.eye(), orbit.target] {
                assert!(p.is_finite());
                assert!(
                    p.cmpge(ROOM.0 + 0.07).all() && p.cmple(ROOM.1 - 0.07).all(),
                    "step {i}: {p}"
                );
            }
        }
    }
}
