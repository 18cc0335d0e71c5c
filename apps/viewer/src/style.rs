//! Colours and spacing: a dark, neutral room around the picture, one warm accent.

use egui::{Color32, CornerRadius, FontFamily, FontId, Stroke, TextStyle, Theme, Visuals};

/// The accent: linen.
pub const ACCENT: Color32 = Color32::from_rgb(222, 178, 118);
/// Ordinary text.
pub const TEXT: Color32 = Color32::from_rgb(214, 212, 208);
/// Text that stays behind.
pub const WEAK: Color32 = Color32::from_rgb(146, 144, 140);
/// The window's ground.
pub const GROUND: Color32 = Color32::from_rgb(30, 30, 31);
/// The ground of plots, text fields and the empty picture.
pub const DEEP: Color32 = Color32::from_rgb(21, 21, 22);
/// Lines of grids and borders.
pub const LINE: Color32 = Color32::from_rgb(62, 61, 60);
/// Measured data.
pub const MEASURED: Color32 = Color32::from_rgb(120, 190, 214);
/// Something went wrong.
pub const WRONG: Color32 = Color32::from_rgb(232, 122, 96);
/// Curves that were pinned, in turn.
pub const PINNED: [Color32; 5] = [
    Color32::from_rgb(150, 186, 120),
    Color32::from_rgb(196, 140, 190),
    Color32::from_rgb(122, 152, 222),
    Color32::from_rgb(214, 206, 120),
    Color32::from_rgb(120, 196, 180),
];

/// Dresses the window.
pub fn dress(ctx: &egui::Context) {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = GROUND;
    visuals.window_fill = Color32::from_rgb(38, 38, 39);
    visuals.window_stroke = Stroke::new(1.0, LINE);
    visuals.extreme_bg_color = DEEP;
    visuals.override_text_color = Some(TEXT);
    visuals.weak_text_color = Some(WEAK);
    visuals.selection.bg_fill = Color32::from_rgb(96, 76, 48);
    visuals.selection.stroke = Stroke::new(1.0, ACCENT);
    visuals.hyperlink_color = ACCENT;
    visuals.error_fg_color = WRONG;
    visuals.slider_trailing_fill = true;
    let radius = CornerRadius::same(4);
    let widgets = &mut visuals.widgets;
    for w in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        w.corner_radius = radius;
    }
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(48, 47, 46));
    widgets.inactive.bg_fill = Color32::from_rgb(58, 57, 56);
    widgets.inactive.weak_bg_fill = Color32::from_rgb(48, 47, 47);
    widgets.hovered.bg_stroke = Stroke::new(1.0, Color32::from_rgb(120, 104, 80));
    ctx.set_theme(Theme::Dark);
    ctx.set_visuals_of(Theme::Dark, visuals);
    ctx.global_style_mut(|style| {
        let sized = |size, family| FontId::new(size, family);
        style
            .text_styles
            .insert(TextStyle::Body, sized(13.0, FontFamily::Proportional));
        style
            .text_styles
            .insert(TextStyle::Button, sized(13.0, FontFamily::Proportional));
        style
            .text_styles
            .insert(TextStyle::Small, sized(11.0, FontFamily::Proportional));
        style
            .text_styles
            .insert(TextStyle::Monospace, sized(11.5, FontFamily::Monospace));
        style
            .text_styles
            .insert(TextStyle::Heading, sized(15.0, FontFamily::Proportional));
        style.spacing.item_spacing = egui::vec2(7.0, 5.0);
        style.spacing.button_padding = egui::vec2(8.0, 3.0);
        style.spacing.slider_rail_height = 4.0;
        style.interaction.tooltip_delay = 0.35;
    });
}

/// Small capitals' stand-in: a heading of a group.
#[must_use]
pub fn group(text: &str) -> egui::RichText {
    egui::RichText::new(text).size(11.5).strong().color(ACCENT)
}

/// Text that stays behind.
#[must_use]
pub fn weak(text: impl Into<String>) -> egui::RichText {
    egui::RichText::new(text).size(11.5).color(WEAK)
}
