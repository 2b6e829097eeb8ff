//! The HTML report in a browser: headless Chromium must load it without an error on the console, in
//! both colour schemes and on a phone, and the map must react.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn example(name: &str) -> String {
    format!("{}/fence_examples/{name}.plan", env!("CARGO_MANIFEST_DIR"))
}

/// Chromium, which `make test` installs.
fn chromium() -> PathBuf {
    let path = std::env::var_os("PATH").unwrap();
    let mut names = ["chromium", "google-chrome"].into_iter();
    let found = names.find_map(|name| {
        std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.exists())
    });
    found.expect("no Chromium: install the package chromium, or run `make test`, which does")
}

fn report(directory: &Path, name: &str, more: &[&str]) -> PathBuf {
    let page = directory.join(format!("{name}.html"));
    let out = page.to_string_lossy().into_owned();
    let mut command = Command::new(env!("CARGO_BIN_EXE_quavd"));
    command.args(["--quiet", "plan", &example(name), "--out", &out]).args(more);
    let status = command.stdout(Stdio::null()).status().unwrap();
    assert!(matches!(status.code(), Some(0 | 3)), "{status}");
    page
}

/// The page's document after `script` has run in it, with everything on the console.
fn loaded(browser: &Path, page: &Path, script: &str, more: &[&str]) -> (String, String) {
    let probe = page.with_extension("probe.html");
    let text = std::fs::read_to_string(page).unwrap();
    let script = format!("<script>addEventListener('load', () => {{ {script} }});</script></body>");
    std::fs::write(&probe, text.replace("</body>", &script)).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(["--virtual-time-budget=2000", "--dump-dom"])
        .args(more)
        .arg(format!("file://{}", probe.display()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let console: String = String::from_utf8_lossy(&output.stderr)
        .lines()
        .filter(|line| line.contains(":CONSOLE"))
        .map(|line| format!("{line}\n"))
        .collect();
    (String::from_utf8(output.stdout).unwrap(), console)
}

#[test]
fn a_report_loads_without_an_error_and_reacts() {
    let browser = chromium();
    let directory = tempfile::tempdir().unwrap();
    let page = report(directory.path(), "s3", &[]);
    let size = page.metadata().unwrap().len();
    assert!(size < 1_000_000, "{size} bytes");
    println!("s3.html: {size} bytes");
    let script = r#"
        const slider = document.getElementById("round");
        slider.value = slider.max;
        slider.dispatchEvent(new Event("input"));
        document.querySelector("button[aria-label='Zoom in']").click();
        document.querySelector("input[data-shows=candidates]").click();
        const mark = document.querySelector(".mark");
        const { x, y } = mark.getBoundingClientRect();
        mark.dispatchEvent(new PointerEvent("pointermove", { bubbles: true, clientX: x, clientY: y }));
        console.assert(document.documentElement.scrollWidth <= innerWidth, "the page is too wide");
    "#;
    let dark = "--blink-settings=preferredColorScheme=0";
    for more in [&["--window-size=1280,900"][..], &["--window-size=400,800", dark]] {
        let (document, console) = loaded(&browser, &page, script, more);
        assert_eq!(console, "", "{more:?}");
        assert!(document.contains("scale(1.4)"), "zoomed");
        assert!(
            document.contains("class=\"incumbent on\" d=") || document.contains("incumbent on")
        );
        assert!(document.contains("Round "), "the round in words");
        assert!(document.contains("data-layer=\"candidates\" class=\"hidden\""), "a layer hidden");
        let tip = document.split("id=\"tip\"").nth(1).unwrap();
        assert!(tip.split("</div>").next().unwrap().contains("item"), "{}", &tip[..200]);
        assert!(document.contains("class=\"scalebar\""));
    }
}

#[test]
fn the_report_of_a_mission_without_a_plan_loads_too() {
    let browser = chromium();
    let directory = tempfile::tempdir().unwrap();
    let page = report(directory.path(), "infeasible", &[]);
    let (document, console) = loaded(&browser, &page, "", &["--window-size=400,800"]);
    assert_eq!(console, "");
    assert!(document.contains("There is no plan:"));
}

#[test]
fn a_comparison_is_a_page_with_the_papers_figures_and_the_curves() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("compare.html");
    let status = Command::new(env!("CARGO_BIN_EXE_quavd"))
        .args(["--quiet", "compare", &example("s5"), "--seeds", "1", "--edges", "20", "--out"])
        .arg(&page)
        .stdout(Stdio::null())
        .status()
        .unwrap();
    assert!(status.success());
    let text = std::fs::read_to_string(&page).unwrap();
    for part in ["A* in the paper", "447.08", "<polyline", "--seeds 1 --edges 20 --buffer 5"] {
        assert!(text.contains(part), "{part}");
    }
    let browser = chromium();
    let (document, console) = loaded(&browser, &page, "", &["--window-size=400,800"]);
    assert_eq!(console, "");
    assert!(document.contains("id=\"save\""));
}
