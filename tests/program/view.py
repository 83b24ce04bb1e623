"""Opens a report in Chromium, plays its view with mouse and keys, and prints what happened as JSON.

    python3 view.py CHROMIUM REPORT.html [--flags=A,B] [--png FILE] [--at SECONDS] [--size 1120x900]

No package is needed: the browser is driven by its own protocol over two pipes.
"""

import base64
import json
import os
import select
import subprocess
import sys
import tempfile
import time


class Browser:
    def __init__(self, program, profile, flags, size):
        # the browser reads from descriptor 3 and writes to descriptor 4
        to_read, self.write = os.pipe()
        self.read, to_write = os.pipe()

        def descriptors():
            high = [os.dup(to_read), os.dup(to_write)]
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        self.process = subprocess.Popen(
            [
                program, "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--hide-scrollbars", "--no-first-run",
                f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}", *flags, "about:blank",
            ],
            preexec_fn=descriptors, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        self.buffer, self.number, self.session, self.errors = b"", 0, None, []

    def message(self, deadline):
        while b"\0" not in self.buffer:
            if not select.select([self.read], [], [], max(0.0, deadline - time.time()))[0]:
                raise TimeoutError("the browser does not answer")
            part = os.read(self.read, 1 << 16)
            if not part:
                raise EOFError("the browser has ended")
            self.buffer += part
        line, self.buffer = self.buffer.split(b"\0", 1)
        found = json.loads(line)
        what, more = found.get("method", ""), found.get("params", {})
        if what == "Runtime.exceptionThrown":
            detail = more["exceptionDetails"]
            self.errors.append(detail.get("exception", {}).get("description") or detail["text"])
        if what == "Runtime.consoleAPICalled" and more["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a)) for a in more["args"]))
        if what == "Log.entryAdded" and more["entry"]["level"] in ("error", "warning"):
            # drawing in software, the browser complains of its own screenshots
            if "GPU stall due to ReadPixels" not in more["entry"]["text"]:
                self.errors.append(more["entry"]["text"])
        return found

    def call(self, method, seconds=60.0, **params):
        self.number += 1
        order = {"id": self.number, "method": method, "params": params}
        if self.session:
            order["sessionId"] = self.session
        os.write(self.write, json.dumps(order).encode() + b"\0")
        deadline = time.time() + seconds
        while True:
            found = self.message(deadline)
            if found.get("id") == self.number:
                if "error" in found:
                    raise RuntimeError(f"{method}: {found['error']}")
                return found["result"]

    def value(self, script):
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(str(found["exceptionDetails"]))
        return found["result"].get("value")

    def until(self, script, seconds):
        deadline = time.time() + seconds
        while time.time() < deadline:
            if self.value(script):
                return True
            time.sleep(0.05)
        return False

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, selector):
        x, y = self.middle(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", buttons=1, clickCount=1)

    def middle(self, selector):
        return self.value(
            f"(e=>{{const r=e.getBoundingClientRect();return [r.x+r.width/2,r.y+r.height/2]}})"
            f"(document.querySelector({json.dumps(selector)}))"
        )

    def key(self, name, code, text=""):
        more = {"text": text} if text else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=name, code=code, **more)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=name, code=code)

    def picture(self, selector=None):
        more = {}
        if selector:
            box = self.value(
                f"(e=>{{const r=e.getBoundingClientRect();return [r.x+scrollX,r.y+scrollY,r.width,r.height]}})"
                f"(document.querySelector({json.dumps(selector)}))"
            )
            more["clip"] = dict(zip(("x", "y", "width", "height"), box), scale=1)
        self.value("new Promise(d=>requestAnimationFrame(()=>requestAnimationFrame(()=>d(1))))")
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", **more)["data"])


SAME = """
(async (a, b) => {
  const pixels = async (text) => {
    const image = await createImageBitmap(await (await fetch('data:image/png;base64,' + text)).blob());
    const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
    pen.drawImage(image, 0, 0);
    return pen.getImageData(0, 0, image.width, image.height).data;
  };
  const [x, y] = [await pixels(a), await pixels(b)];
  return x.length === y.length && x.filter((v, i) => Math.abs(v - y[i]) > 16).length < 1e-4 * x.length;
})
"""


def same(b, one, other):
    """Whether two pictures are the same but for the rounding of a few pixels."""
    texts = [json.dumps(base64.b64encode(p).decode()) for p in (one, other)]
    return b.value(f"({SAME})({texts[0]}, {texts[1]})")


TIME = "Number(document.querySelector('.view').dataset.time)"


def play(b):
    """What a reader would do."""
    out = {"renderer": b.value("document.querySelector('.view').dataset.ready")}
    b.value("document.querySelector('.view').scrollIntoView({block:'start'})")
    still = b.picture(".view .stage")
    out["picture"] = len(still)
    out["label"] = b.value("document.querySelector('.view canvas').getAttribute('aria-label')")
    out["unnamed"] = b.value(
        "[...document.querySelectorAll('.view button,.view input,.view select')].filter(e=>"
        "!(e.textContent.trim()||e.getAttribute('aria-label')||e.closest('label'))).length"
    )
    out["start"] = b.value(TIME)
    b.value(
        "(s=>{s.value='4';s.dispatchEvent(new Event('change',{bubbles:true}))})(document.querySelector('.view select'))"
    )
    b.click(".view .play")
    out["plays"] = b.until(f"{TIME} > {out['start']} + 1.5", 30)
    b.key(" ", "Space", " ")
    b.value("new Promise(d=>setTimeout(d,100))")
    out["paused"] = b.value(TIME)
    out["rests"] = not b.until(f"{TIME} !== {out['paused']}", 0.5)
    out["moves"] = not same(b, b.picture(".view .stage"), still)
    # the slider
    middle = (
        "(s=>{s.value=Number(s.max)/2;s.dispatchEvent(new Event('input',{bubbles:true}))})"
        "(document.querySelector('.view input[type=range]'))"
    )
    b.value(middle)
    out["scrubbed"] = b.until(f"Math.abs({TIME} - 0.5 * document.querySelector('.view input').max) < 0.01", 5)
    # turned by the mouse, back by the button
    before = b.picture(".view .stage")
    x, y = b.middle(".view .stage")
    b.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
    b.mouse("mouseMoved", x + 90, y + 30, button="left", buttons=1)
    b.mouse("mouseReleased", x + 90, y + 30, button="left")
    turned = b.picture(".view .stage")
    out["turns"] = not same(b, turned, before)
    b.mouse("mouseWheel", x, y, deltaX=0, deltaY=-240)
    out["zooms"] = not same(b, b.picture(".view .stage"), turned)
    at = b.value(TIME)
    b.key("ArrowRight", "ArrowRight")
    out["steps"] = b.until(f"{TIME} > {at}", 5)
    b.value(middle)
    b.click(".view .reset")
    b.value("document.activeElement.blur()")
    b.mouse("mouseMoved", 1, 1)
    out["resets"] = same(b, b.picture(".view .stage"), before)
    # what the pointer is over has a name
    left, top, wide, high = b.value(
        "(r=>[r.x,r.y,r.width,r.height])(document.querySelector('.view .stage').getBoundingClientRect())"
    )
    names = set()
    for i in range(1, 16):
        for k in range(1, 10):
            b.mouse("mouseMoved", left + wide * i / 16, top + high * k / 10)
            names.add(b.value("(e=>e.hidden?'':e.textContent)(document.querySelector('.view .name'))"))
    out["names"] = sorted(names - {""})
    b.mouse("mouseMoved", 1, 1)
    for box in b.value("[...document.querySelectorAll('.view [type=checkbox]')].map(e=>e.name)"):
        with_it = b.picture(".view .stage")
        b.click(f".view [name={box}]")
        out[f"box {box}"] = not same(b, b.picture(".view .stage"), with_it)
        b.click(f".view [name={box}]")
    return out


def main():
    words = sys.argv[1:]
    options = {"--flags": "", "--png": None, "--at": None, "--size": "1120x900"}
    for name in options:
        if name in words:
            at = words.index(name)
            options[name] = words[at + 1]
            del words[at:at + 2]
    program, report = words
    flags = [f for f in options["--flags"].split(",") if f]
    size = [int(x) for x in options["--size"].split("x")]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(program, profile, flags, size)
        try:
            target = b.call("Target.createTarget", url="about:blank")["targetId"]
            b.session = b.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            for domain in ("Page", "Runtime", "Log"):
                b.call(f"{domain}.enable")
            b.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
            b.call("Page.navigate", url=f"file://{os.path.abspath(report)}")
            if not b.until("document.readyState === 'complete' && document.querySelector('.view[data-ready]') !== null", 60):
                print(json.dumps({"errors": b.errors + ["the view does not start"]}))
                return
            if options["--png"]:
                if options["--at"]:
                    b.value(
                        f"(s=>{{s.value={options['--at']};s.dispatchEvent(new Event('input',{{bubbles:true}}))}})"
                        "(document.querySelector('.view input[type=range]'))"
                    )
                b.value("document.querySelector('.view').closest('section').scrollIntoView({block:'start'})")
                with open(options["--png"], "wb") as file:
                    file.write(b.picture())
                out = {"renderer": b.value("document.querySelector('.view').dataset.ready")}
            else:
                out = play(b)
            out["errors"] = b.errors
            print(json.dumps(out))
        finally:
            b.process.kill()
            b.process.wait()


main()
