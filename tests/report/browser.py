"""Opens index.html of a report as a person would: nothing is asked of the network, nothing is wrong, every figure is there.

Usage: browser.py DIR SCREENSHOTS
"""
import os
import pathlib
import sys

from playwright.sync_api import sync_playwright

page_file = pathlib.Path(sys.argv[1]).resolve() / "index.html"
shots = pathlib.Path(sys.argv[2])
files = list((page_file.parent / "figures").glob("*.svg"))
sizes = {"wide": (1400, 900), "phone": (390, 800)}
wrong = []

with sync_playwright() as playwright:
    browser = playwright.chromium.launch(
        executable_path=os.environ.get("CHROMIUM") or None,
        args=["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
    )
    for scheme in ("light", "dark"):
        for size, (width, height) in sizes.items():
            name = f"{scheme}-{size}"
            page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
            page.set_default_timeout(120_000)  # also on a busy machine
            page.on("request", lambda r: r.url.startswith(("file:", "data:")) or wrong.append(f"{name}: asks for {r.url}"))
            page.on("console", lambda m: m.type in ("error", "warning") and wrong.append(f"{name}: console: {m.text}"))
            page.on("pageerror", lambda e: wrong.append(f"{name}: {e}"))
            page.goto(page_file.as_uri())
            page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true })")
            figures = page.locator("figure svg")
            if figures.count() != len(files) or not files:
                wrong.append(f"{name}: {figures.count()} figures, {len(files)} in figures/")
            for i in range(figures.count()):
                box = figures.nth(i).bounding_box()
                if box is None or box["width"] < 100 or box["height"] < 50:
                    wrong.append(f"{name}: figure {i} has the box {box}")
            for i in range(page.locator("table").count()):
                box = page.locator("table").nth(i).bounding_box()
                if box is None or box["width"] < 50 or box["height"] < 20:
                    wrong.append(f"{name}: table {i} has the box {box}")
            # Wide figures and tables scroll in their own box, the page does not.
            if page.evaluate("document.documentElement.scrollWidth") > width:
                wrong.append(f"{name}: the page is wider than the window")
            # Every label lies inside its picture.
            outside = page.evaluate(
                """() => [...document.querySelectorAll('figure svg')].flatMap(svg => {
                    const frame = svg.getBoundingClientRect()
                    return [...svg.querySelectorAll('text')].filter(t => {
                        const b = t.getBoundingClientRect()
                        return b.left < frame.left - 1 || b.right > frame.right + 1 || b.top < frame.top - 1 || b.bottom > frame.bottom + 1
                    }).map(t => svg.querySelector('title').textContent + ': ' + t.textContent)
                })"""
            )
            wrong += [f"{name}: outside its picture: {label}" for label in outside]
            page.screenshot(path=shots / f"{name}.png", full_page=True)
            print(f"{name}: {figures.count()} figures, {page.locator('table').count()} tables")
            page.close()
    browser.close()

for line in wrong:
    print(line, file=sys.stderr)
print(f"report-test: {'failed' if wrong else 'passed'}; screenshots in {shots}")
sys.exit(1 if wrong else 0)
