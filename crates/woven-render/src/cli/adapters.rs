//! `woven-render adapters`: what GPUs there are and which would be used.

use anyhow::Result;

/// List the GPUs there are.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  woven-render adapters
  woven-render adapters --json")]
pub(crate) struct AdaptersArgs {
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

/// Lists them on stdout.
pub(crate) fn run(args: &AdaptersArgs) -> Result<()> {
    let found = woven_render::gpu::adapters();
    if args.json {
        let rows: Vec<_> = found
            .iter()
            .map(|a| {
                serde_json::json!({
                    "name": a.name, "driver": a.driver, "backend": a.backend, "kind": a.kind,
                    "software": a.software, "chosen": a.chosen,
                })
            })
            .collect();
        println!("{}", serde_json::to_string_pretty(&rows)?);
        return Ok(());
    }
    if found.is_empty() {
        println!(
            "No GPU and no Vulkan, Metal or DirectX 12 driver was found; rendering uses the CPU."
        );
        println!("On Debian or Ubuntu, mesa-vulkan-drivers brings a software one (lavapipe).");
        return Ok(());
    }
    for a in &found {
        let mark = if a.chosen { '*' } else { ' ' };
        println!(
            "{mark} {} ({}, {}, {})",
            a.name, a.kind, a.backend, a.driver
        );
    }
    if found.iter().all(|a| a.software) {
        println!(
            "Only software adapters: --backend auto uses the CPU, --backend gpu the one marked *."
        );
    } else {
        println!("--backend auto and gpu use the one marked *.");
    }
    Ok(())
}
