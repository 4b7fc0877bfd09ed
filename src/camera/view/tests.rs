//! Views against cameras and against matrices by hand.

use super::*;
use crate::camera::DepthDirection;
use glam::dcamera::lh;
use glam::dcamera::rh::proj::{directx, vulkan};

const CAMERA: Camera = Camera {
    eye: DVec3::new(3e5, 1234.5, -7e4),
    heading_deg: 33.0,
    pitch_deg: -12.0,
    roll_deg: 71.0,
    fov_deg: 47.0,
};

/// The view matrix of a camera.
fn view_matrix(camera: &Camera) -> DMat4 {
    let axes = camera.axes();
    let rows = DMat3::from_cols(axes.col(0), axes.col(1), -axes.col(2)).transpose();
    DMat4::from_mat3_translation(rows, -(rows * camera.eye))
}

fn close(a: [DVec3; 3], b: [DVec3; 3], slack: f64) -> bool {
    (0..3).all(|k| a[k].abs_diff_eq(b[k], slack * b[k].length()))
}

#[test]
fn the_frustum_s_corner_is_at_one() {
    let camera = Camera {
        eye: DVec3::ZERO,
        heading_deg: 0.0,
        pitch_deg: 0.0,
        roll_deg: 0.0,
        fov_deg: 90.0,
    };
    let view = View::new(camera, [200, 100]).unwrap();
    let [x, y, w] = view.clip_rows().map(|row| row.dot(DVec3::new(2.0, 1.0, -1.0)));
    assert!(
        (x - 1.0).abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && w == 1.0,
        "{x} {y} {w}"
    );
}

#[test]
fn a_ray_projects_to_its_pixel() {
    let view = View::new(CAMERA, [320, 200]).unwrap();
    for pixel in [[0.0, 0.0], [320.0, 0.0], [160.0, 100.0], [17.5, 191.25]] {
        let ray = view.ray(pixel);
        let [x, y, w] = view.clip_rows().map(|row| row.dot(ray));
        let back = [(x / w + 1.0) * 160.0, (1.0 - y / w) * 100.0];
        assert!((w - 1.0).abs() < 1e-14);
        let close = (0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-11);
        assert!(close, "{pixel:?}: {back:?}");
    }
    let axis = CAMERA.axes().col(2);
    assert_eq!(view.ray([160.0, 100.0]), axis, "the axis is in the middle");
}

#[test]
fn pictures_without_pixels_are_refused() {
    assert!(View::new(CAMERA, [0, 5]).is_err());
    assert!(View::new(CAMERA, [5, MAX_PICTURE_PX + 1]).is_err());
    let projection = directx::perspective_infinite_reverse(1.0, 1.0, 1.0);
    assert!(View::from_matrices(view_matrix(&CAMERA), projection, [0, 5]).is_err());
}

#[test]
fn matrices_see_what_the_camera_sees() {
    let size_px = [300, 200];
    let of_camera = View::new(CAMERA, size_px).unwrap();
    let fov = CAMERA.fov_deg.to_radians();
    for (projection, near, far, direction) in [
        (
            directx::perspective_infinite_reverse(fov, 1.5, 0.25),
            0.25,
            f64::INFINITY,
            DepthDirection::Reversed,
        ),
        (
            directx::perspective_infinite(fov, 1.5, 0.25),
            0.25,
            f64::INFINITY,
            DepthDirection::Forward,
        ),
        (
            directx::perspective(fov, 1.5, 2.0, 5e4),
            2.0,
            5e4,
            DepthDirection::Forward,
        ),
        (
            directx::perspective(fov, 1.5, 5e4, 2.0),
            2.0,
            5e4,
            DepthDirection::Reversed,
        ),
    ] {
        // A projection's common factor is no part of it.
        for factor in [1.0, 3.0] {
            let view = View::from_matrices(view_matrix(&CAMERA), projection * factor, size_px).unwrap();
            assert!(view.eye.abs_diff_eq(CAMERA.eye, 1e-9));
            assert!(close(view.clip_rows(), of_camera.clip_rows(), 1e-14));
            assert!(close(view.rays(), of_camera.rays(), 1e-14));
            let depth = view.depth().unwrap();
            assert_eq!(depth.direction(), direction);
            assert!((depth.near_m() / near - 1.0).abs() < 1e-12, "{depth:?}");
            assert!(
                depth.far_m() == far || (depth.far_m() / far - 1.0).abs() < 1e-9,
                "{depth:?}"
            );
        }
    }
    assert_eq!(of_camera.depth(), None);
    let infinite = directx::perspective_infinite_reverse(fov, 1.5, 0.25);
    let view = View::from_matrices(view_matrix(&CAMERA), infinite, size_px).unwrap();
    assert_eq!(view.depth().unwrap().terms(), [0.0, 0.25], "to the bit");
}

#[test]
fn rays_and_rows_agree_with_the_matrices_off_the_axis_and_turned() {
    let view = view_matrix(&CAMERA);
    let off_axis = directx::frustum(-0.3, 1.1, -0.2, 0.9, 1.0, 1e5);
    let turned = DMat4::from_rotation_z(0.5) * off_axis;
    for projection in [off_axis, turned] {
        let seen = View::from_matrices(view, projection, [64, 64]).unwrap();
        let [right, up, middle] = seen.rays();
        for (x, y) in [(0.0, 0.0), (1.0, -1.0), (-0.25, 0.75)] {
            let ray = right * x + up * y + middle;
            let point = CAMERA.eye + ray * 700.0;
            let clip = projection * view * point.extend(1.0);
            assert!((clip.x / clip.w - x).abs() < 1e-9 && (clip.y / clip.w - y).abs() < 1e-9);
            assert!((clip.w - 700.0).abs() < 1e-6);
            let [cx, cy, cw] = seen.clip_rows().map(|row| row.dot(point - seen.eye));
            assert!((cx - clip.x).abs() < 1e-6 && (cy - clip.y).abs() < 1e-6 && (cw - clip.w).abs() < 1e-6);
            let [a, b] = seen.depth().unwrap().terms();
            assert!((a * cw + b - clip.z).abs() < 1e-6);
        }
    }
}

#[test]
fn matrices_that_are_no_view_are_refused_with_what_is_wrong() {
    let projection = directx::perspective_infinite_reverse(1.0, 1.0, 1.0);
    let good = view_matrix(&CAMERA);
    let nan = |mut m: DMat4| {
        m.y_axis.x = f64::NAN;
        m
    };
    let shear = DMat4::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z));
    for (view, word) in [
        (nan(good), "finite"),
        (DMat4::from_scale(DVec3::splat(2.0)) * good, "scales"),
        (
            DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)) * good,
            "left-handed",
        ),
        (shear * good, "shears"),
        (DMat4::ZERO, "last row"),
        (projection * good, "last row"),
    ] {
        let error = View::from_matrices(view, projection, [64, 64]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Misuse);
        assert!(error.to_string().contains(word), "{error}: {word}");
    }
    let near_oblique = {
        let mut m = directx::perspective(1.0, 1.0, 1.0, 9.0);
        m.x_axis.z = 0.3;
        m
    };
    for (projection, word) in [
        (nan(projection), "finite"),
        (
            directx::orthographic(-1.0, 1.0, -1.0, 1.0, 1.0, 9.0),
            "orthographic",
        ),
        (lh::proj::directx::perspective(1.0, 1.0, 1.0, 9.0), "left-handed"),
        (vulkan::perspective(1.0, 1.0, 1.0, 9.0), "mirrors"),
        (
            DMat4::from_scale(DVec3::new(0.0, 1.0, 1.0)) * projection,
            "singular",
        ),
        (near_oblique, "oblique"),
        (DMat4::ZERO, "clip w"),
        (projection * DMat4::from_rotation_x(0.2), "clip w"),
        (projection * DMat4::from_translation(DVec3::X), "centred"),
        (
            DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0)) * projection,
            "distance",
        ),
    ] {
        let error = View::from_matrices(good, projection, [64, 64]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Misuse);
        assert!(error.to_string().contains(word), "{error}: {word}");
    }
    // Made in f32, a view is rigid but for rounding.
    assert!(View::from_matrices(good.as_mat4().as_dmat4(), projection, [64, 64]).is_ok());
}

#[test]
fn an_eye_set_to_no_number_is_noticed() {
    let mut view = View::new(CAMERA, [64, 64]).unwrap();
    assert!(view.check().is_ok());
    view.eye.x = f64::NAN;
    assert_eq!(view.check().unwrap_err().kind(), ErrorKind::Misuse);
}
