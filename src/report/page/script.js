"use strict";
// Zoom, pan, what is under the pointer, and the incumbent of a round. Without it the page still
// shows the whole map, the charts and all tables.
(() => {
  const save = document.getElementById("save");
  if (save) {
    save.addEventListener("click", () => {
      const text = document.getElementById("document").textContent;
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
      link.download = save.dataset.name;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
    save.hidden = false;
  }

  const map = document.getElementById("map");
  if (!map) return;
  const box = map.closest(".mapbox");
  const world = document.getElementById("world");
  const base = map.viewBox.baseVal;
  const home = { x: base.x, y: base.y, w: base.width, h: base.height };
  const unitsPerMetre = Number(box.dataset.scale);
  let zoom = 1, x = 0, y = 0;

  const bar = document.createElement("div");
  bar.className = "scalebar";
  bar.append(document.createTextNode(""), document.createElement("span"));
  box.append(bar);

  function show() {
    // Never so far that nothing is left in sight.
    x = Math.min(Math.max(x, -home.w * zoom), home.w);
    y = Math.min(Math.max(y, -home.h * zoom), home.h);
    world.setAttribute("transform", `translate(${x} ${y}) scale(${zoom})`);
    map.style.setProperty("--inverse", 1 / zoom);
    const pixels = Math.min(map.clientWidth / home.w, map.clientHeight / home.h) || 1;
    const perMetre = unitsPerMetre * zoom * pixels;
    const most = Math.min(120, map.clientWidth / 3) / perMetre;
    const decade = 10 ** Math.floor(Math.log10(most));
    const metres = [5, 2, 1].map((k) => k * decade).find((k) => k <= most) || decade;
    bar.firstChild.data = metres >= 1000 ? `${metres / 1000} km` : `${+metres.toPrecision(1)} m`;
    bar.lastChild.style.width = `${metres * perMetre}px`;
  }

  function at(event) {
    const point = new DOMPoint(event.clientX, event.clientY);
    return point.matrixTransform(map.getScreenCTM().inverse());
  }

  function zoomBy(factor, px, py) {
    const next = Math.min(Math.max(zoom * factor, 0.3), 200);
    x = px - ((px - x) * next) / zoom;
    y = py - ((py - y) * next) / zoom;
    zoom = next;
    show();
  }
  const zoomAtCentre = (factor) => zoomBy(factor, home.w / 2, home.h / 2);
  function reset() { zoom = 1; x = 0; y = 0; show(); }

  map.addEventListener("wheel", (event) => {
    event.preventDefault();
    const p = at(event);
    zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), p.x, p.y);
  }, { passive: false });

  // One pointer drags, two pinch.
  const pointers = new Map();
  map.addEventListener("pointerdown", (event) => {
    pointers.set(event.pointerId, at(event));
    if (event.pointerType !== "mouse") tell(event);
  });
  map.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) { tell(event); return; }
    const before = pointers.get(event.pointerId), now = at(event);
    if (pointers.size === 1) {
      if (!map.hasPointerCapture(event.pointerId)) map.setPointerCapture(event.pointerId);
      map.classList.add("dragged");
      x += now.x - before.x;
      y += now.y - before.y;
      show();
    } else if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y) || 1;
      zoomBy(distance(now, other) / distance(before, other), other.x, other.y);
    }
    pointers.set(event.pointerId, now);
  });
  const release = (event) => {
    pointers.delete(event.pointerId);
    map.classList.remove("dragged");
  };
  map.addEventListener("pointerup", release);
  map.addEventListener("pointercancel", release);
  map.addEventListener("pointerleave", () => { tip.hidden = true; });
  map.addEventListener("keydown", (event) => {
    const step = 60;
    const act = {
      "+": () => zoomAtCentre(1.4), "=": () => zoomAtCentre(1.4), "-": () => zoomAtCentre(1 / 1.4),
      0: reset,
      ArrowLeft: () => { x += step; show(); }, ArrowRight: () => { x -= step; show(); },
      ArrowUp: () => { y += step; show(); }, ArrowDown: () => { y -= step; show(); },
      Escape: () => { tip.hidden = true; },
    }[event.key];
    if (act) { act(); event.preventDefault(); }
  });

  const buttons = document.createElement("div");
  buttons.className = "zoom";
  for (const [sign, name, act] of [
    ["+", "Zoom in", () => zoomAtCentre(1.4)], ["−", "Zoom out", () => zoomAtCentre(1 / 1.4)],
    ["⌂", "Show the whole route", reset],
  ]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = sign;
    button.setAttribute("aria-label", name);
    button.addEventListener("click", act);
    buttons.append(button);
  }
  box.append(buttons);

  const tip = document.createElement("div");
  tip.id = "tip";
  tip.setAttribute("role", "status");
  tip.hidden = true;
  document.body.append(tip);
  function place(px, py) {
    tip.hidden = false;
    const { width, height } = tip.getBoundingClientRect();
    tip.style.left = `${Math.max(4, Math.min(px + 14, innerWidth - width - 4))}px`;
    tip.style.top = `${py + 16 + height > innerHeight ? py - height - 10 : py + 16}px`;
  }
  function tell(event) {
    const element = event.target.closest("[data-tip]");
    if (!element || !element.dataset.tip) { tip.hidden = true; return; }
    tip.textContent = element.dataset.tip;
    place(event.clientX, event.clientY);
  }
  map.addEventListener("focusin", (event) => {
    const mark = event.target.closest(".mark");
    if (!mark || !mark.matches(":focus-visible")) return;
    const { right, bottom } = mark.getBoundingClientRect();
    tip.textContent = mark.dataset.tip;
    place(right, bottom);
  });
  map.addEventListener("focusout", () => { tip.hidden = true; });

  for (const layer of document.querySelectorAll("input[data-shows]")) {
    layer.addEventListener("change", () => {
      for (const part of map.querySelectorAll(`[data-layer="${layer.dataset.shows}"]`)) {
        part.classList.toggle("hidden", !layer.checked);
      }
    });
  }

  const rounds = document.getElementById("rounds-data");
  if (rounds) {
    const legs = JSON.parse(rounds.textContent);
    const choice = document.getElementById("round-leg");
    const slider = document.getElementById("round");
    const words = document.getElementById("round-words");
    const paths = [...map.querySelectorAll(".incumbent")];
    const showRound = () => {
      const leg = Number(choice.value), number = Number(slider.value);
      for (const path of paths) {
        const { leg: of, from, to } = path.dataset;
        path.classList.toggle("on", Number(of) === leg && from <= number && number <= Number(to));
      }
      words.textContent = legs[leg].rounds[number];
      slider.setAttribute("aria-valuetext", words.textContent);
    };
    const chooseLeg = () => {
      slider.max = legs[choice.value].rounds.length - 1;
      slider.value = 0;
      for (const path of paths) path.classList.remove("on");
      words.textContent = "Move the slider to see the path after each round.";
    };
    choice.addEventListener("change", chooseLeg);
    slider.addEventListener("input", showRound);
    chooseLeg();
  }

  addEventListener("resize", show);
  show();
})();
