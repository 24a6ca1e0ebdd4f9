"""Opens a page of hilt view as a person would: plays it, drags the time, reads the poses back and compares them with what the recordings' /tf says.

Usage: viewer.py PAGE SCREENSHOTS RECORDING...   (the recordings that the page shows, in its order)
"""
import os
import pathlib
import sys
import time

from mcap_protobuf.reader import read_protobuf_messages
from playwright.sync_api import sync_playwright

page_file, shots = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
recordings = sys.argv[3:]
MOST_BYTES = 1_500_000  # of a page of four episodes
FIRST_MS = 1000  # until the first picture
FRAME_MS = 1000 / 60  # a picture of 800 x 600 pixels, by software
NEAR_M = 2e-5  # single precision of positions that add up along an arm
PERIOD_S = 0.05
wrong = []


def product(a, b):
    """Matrices column by column."""
    return [sum(a[r + 4 * k] * b[4 * c + k] for k in range(4)) for c in range(4) for r in range(4)]


def matrix(t, q):
    x, y, z, w = q.x, q.y, q.z, q.w
    return [
        1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
        2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
        2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
        t.x, t.y, t.z, 1,
    ]  # fmt: skip


def recorded(path):
    """For every step, the world's view of all frames, links first, in the order of the file."""
    steps = []
    for message in read_protobuf_messages(path, topics=["/tf"]):
        frames = {"world": matrix(*origin())}
        for transform in message.proto_msg.transforms:
            own = matrix(transform.translation, transform.rotation)
            frames[transform.child_frame_id] = product(frames[transform.parent_frame_id], own)
        del frames["world"]
        links = [m for name, m in frames.items() if not name.startswith("object/")]
        objects = [m for name, m in frames.items() if name.startswith("object/")]
        steps.append((links, objects))
    return steps


def origin():
    from types import SimpleNamespace as Of

    return Of(x=0, y=0, z=0), Of(x=0, y=0, z=0, w=1)


def apart(seen, steps, step):
    links, objects = steps[min(step, len(steps) - 1)]
    pairs = list(zip(seen["links"] + seen["objects"], links + objects, strict=True))
    return max(abs(a - b) for one, other in pairs for a, b in zip(one, other))


def check(page, truth, name):
    end = page.evaluate("hilt.state.duration")
    # Plays by itself.
    before = page.evaluate("hilt.state.time")
    page.wait_for_timeout(700)
    if not page.evaluate("hilt.state.time") > before:
        wrong.append(f"{name}: does not play")
    page.keyboard.press(" ")
    still = page.evaluate("hilt.state.time")
    page.wait_for_timeout(200)
    if page.evaluate("hilt.state.playing") or page.evaluate("hilt.state.time") != still:
        wrong.append(f"{name}: space does not stop it")
    # Drags the slider, then goes to the nearest step and reads what is seen.
    box = page.locator("#slider").bounding_box()
    for share in (0.0, 0.23, 0.5, 0.77, 1.0):
        x, y = box["x"] + 6 + share * (box["width"] - 12), box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + 0.4 * box["width"], y)
        page.mouse.down()
        page.mouse.move(x, y, steps=4)
        page.mouse.up()
        now = page.evaluate("hilt.state.time")
        if abs(now - share * end) > 0.02 * end:
            wrong.append(f"{name}: dragged to {share * end:.2f} s, shows {now:.2f} s")
        step = round(now / PERIOD_S)
        page.evaluate(f"hilt.seek({step * PERIOD_S}), hilt.frame()")
        for n in page.evaluate("hilt.state.shown"):
            off = apart(page.evaluate(f"hilt.poses({n})"), truth[n], step)
            if not off < NEAR_M:
                wrong.append(f"{name}: episode {n}, step {step}: {off} m from the recording")
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowLeft")
    if abs(page.evaluate("hilt.state.time") - 9 * PERIOD_S) > 1e-6:
        wrong.append(f"{name}: ten steps on and one back are at {page.evaluate('hilt.state.time')} s")
    # Not all of one colour.
    colours = page.evaluate(
        """() => { hilt.frame(); const of = document.getElementById('view'), to = document.createElement('canvas');
        [to.width, to.height] = [of.width, of.height]; const pen = to.getContext('2d'); pen.drawImage(of, 0, 0);
        const bytes = new Uint32Array(pen.getImageData(0, 0, to.width, to.height).data.buffer); return new Set(bytes).size }"""
    )
    if colours < 200:
        wrong.append(f"{name}: the scene has {colours} colours")


def touch(page, name):
    """One finger turns the eye, two that part bring it nearer by as much as they part, and the slider follows a finger."""
    client = page.context.new_cdp_session(page)

    def fingers(kind, *places):
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def eye():
        return page.evaluate("[hilt.camera.turn, hilt.camera.rise, hilt.camera.distance]")

    page.evaluate("document.getElementById('view').scrollIntoView(), hilt.camera.reset(), hilt.frame()")
    box = page.locator("#view").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before = eye()
    fingers("touchStart", (x, y))
    for moved in (10, 20, 30, 40):
        fingers("touchMove", (x + moved, y))
    fingers("touchEnd")
    after = eye()
    if not (abs(after[0] - before[0]) > 0.1 and after[1:] == before[1:]):
        wrong.append(f"{name}: a finger that goes 40 pixels to the right turns {before} to {after}")
    fingers("touchStart", (x - 30, y))
    fingers("touchStart", (x - 30, y), (x + 30, y))
    for apart in (40, 50, 60):
        fingers("touchMove", (x - apart, y), (x + apart, y))
    fingers("touchEnd")
    nearer = eye()
    if not (nearer[0] == after[0] and abs(nearer[2] / after[2] - 0.5) < 0.02):
        wrong.append(f"{name}: fingers that part to twice their distance bring the eye from {after[2]} to {nearer[2]} m")
    page.evaluate("document.getElementById('slider').scrollIntoView()")
    box = page.locator("#slider").bounding_box()
    y = box["y"] + box["height"] / 2
    fingers("touchStart", (box["x"] + 0.3 * box["width"], y))
    fingers("touchMove", (box["x"] + 0.5 * box["width"], y))
    fingers("touchMove", (box["x"] + 6 + 0.7 * (box["width"] - 12), y))
    fingers("touchEnd")
    share = page.evaluate("hilt.state.time / hilt.state.duration")
    if abs(share - 0.7) > 0.02:
        wrong.append(f"{name}: a finger at .70 of the slider shows {share:.2f} of the time")
    page.evaluate("hilt.camera.reset(), window.scrollTo(0, 0)")


with sync_playwright() as playwright:
    browser = playwright.chromium.launch(
        executable_path=os.environ.get("CHROMIUM") or None,
        args=[
            "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
        ],
    )  # fmt: skip
    truth = [recorded(path) for path in recordings]
    sizes = {"wide": (1400, 900), "phone": (390, 844), "small": (800, 600)}
    for scheme in ("light", "dark"):
        for size, (width, height) in sizes.items():
            name = f"view-{scheme}-{size}"
            page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme, has_touch=size == "phone")
            page.set_default_timeout(120_000)  # also on a busy machine
            page.on("request", lambda r: r.url.startswith(("file:", "data:")) or wrong.append(f"{name}: asks for {r.url}"))
            page.on("console", lambda m: m.type in ("error", "warning") and wrong.append(f"{name}: console: {m.text}"))
            page.on("pageerror", lambda e: wrong.append(f"{name}: {e}"))
            page.goto(page_file.as_uri())
            first = page.evaluate("hilt.firstFrame_ms")
            if truth:
                check(page, truth, name)
            if size == "phone":
                touch(page, name)
            if page.evaluate("document.documentElement.scrollWidth") > width:
                wrong.append(f"{name}: the page is wider than the window")
            page.evaluate("hilt.seek(hilt.state.duration * 0.62), hilt.frame()")
            page.screenshot(path=shots / f"{name}.png", full_page=True)
            page.keyboard.press("o")
            page.wait_for_timeout(100)
            page.screenshot(path=shots / f"{name}-overlay.png")
            page.keyboard.press("o")
            page.keyboard.press("1")
            page.wait_for_timeout(100)
            page.screenshot(path=shots / f"{name}-one.png")
            page.evaluate("Object.assign(document.getElementById('view').style, { width: '800px', height: '600px' }), hilt.frame()")
            own = page.evaluate("hilt.pictureTime_ms(40)")
            page.evaluate("hilt.show([...Array(Math.min(4, document.querySelectorAll('.chip').length || 1)).keys()], 0), hilt.frame()")
            four = page.evaluate("hilt.pictureTime_ms(40)")
            print(f"{name}: first picture after {first:.0f} ms, one episode {own:.1f} ms a picture, four {four:.1f} ms")
            if first > FIRST_MS:
                print(f"{name}: the first picture took more than {FIRST_MS} ms: a busy machine?")
            if size == "small" and own > FRAME_MS:
                print(f"{name}: {1000 / own:.0f} pictures a second instead of 60: a busy machine?")
            page.close()
    browser.close()

size = page_file.stat().st_size
print(f"{page_file.name}: {size} bytes")
if size > MOST_BYTES:
    wrong.append(f"the page has {size} bytes, more than {MOST_BYTES}")
for line in wrong:
    print(line, file=sys.stderr)
print(f"view-test: {'failed' if wrong else 'passed'}; screenshots in {shots}")
sys.exit(1 if wrong else 0)
