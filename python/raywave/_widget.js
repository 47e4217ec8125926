// SPDX-License-Identifier: Apache-2.0
// The front end of rw.view: a picture to drag, sliders, a line of text.

function render({model, el}) {
  const add = (tag, parent = el) => parent.appendChild(document.createElement(tag));
  const ask = (trait, value) => {
    model.set(trait, value);
    model.save_changes();
  };
  const follow = (trait, show) => {
    model.on(`change:${trait}`, () => show(model.get(trait)));
    show(model.get(trait));
  };

  const picture = add("img");
  picture.style = "display: block; width: 640px; max-width: 100%; cursor: grab; touch-action: none";
  picture.draggable = false;
  follow("picture", (png) => {
    URL.revokeObjectURL(picture.src);
    picture.src = URL.createObjectURL(new Blob([png], {type: "image/png"}));
  });
  let last = null;
  picture.onpointerdown = (event) => {
    picture.setPointerCapture(event.pointerId);
    last = event;
  };
  picture.onpointermove = (event) => {
    if (!last) return;
    const degrees = 180 / picture.clientHeight, [x, y] = model.get("drag");
    ask("drag", [x + degrees * (last.clientY - event.clientY),
                 y + degrees * (event.clientX - last.clientX)]);
    last = event;
  };
  picture.onpointerup = picture.onpointercancel = () => { last = null; };

  const slider = (label, trait, [min, max, step], shown, asked) => {
    const row = add("label"), input = add("input", row), text = add("span", row);
    Object.assign(input, {type: "range", min, max, step});
    row.style.display = "block";
    input.oninput = () => ask(trait, asked(input.valueAsNumber));
    follow(trait, (value) => {
      input.value = shown(value);
      text.textContent = ` ${label} ${+shown(value).toPrecision(4)}`;
    });
  };
  const [near, far] = model.get("depths").map((depth) => 1e3 * depth);
  slider("focus, mm:", "focus", [near, far, (far - near) / 200], (z) => 1e3 * z, (mm) => mm / 1e3);
  // The viewer has -x at the right
  const view = () => model.get("view");
  slider("eye right:", "view", [-1, 1, 0.05], ([x]) => -x, (x) => [-x, view()[1]]);
  slider("eye up:", "view", [-1, 1, 0.05], ([, y]) => y, (y) => [view()[0], y]);
  slider("part of the hologram:", "aperture", [0.05, 1, 0.05], (size) => size, (size) => size);
  const line = add("div");
  follow("message", (message) => { line.textContent = message; });
}

export default {render};
