// Draws the figures of the page from #figures and keeps their time axes together.
"use strict";
(() => {
  const { figures, columns } = JSON.parse(document.getElementById("figures").textContent);
  const narrow = () => window.innerWidth < 700;
  const touch = window.matchMedia("(pointer: coarse)").matches;

  function numbers(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
  }
  const unpacked = columns.map(numbers);

  // { column: which, from: offset } becomes an array of numbers.
  function unpack(value) {
    if (Array.isArray(value)) return value.map(unpack);
    if (value === null || typeof value !== "object") return value;
    if ("column" in value) return Array.from(unpacked[value.column], (x) => x + value.from);
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, unpack(v)]));
  }

  function fitted(layout) {
    if (!narrow()) return layout;
    const axis = Object.keys(layout).filter((k) => k.startsWith("xaxis"));
    for (const k of axis) layout[k].nticks = Math.min(layout[k].nticks || 5, 5);
    layout.margin = { ...layout.margin, l: 46, r: 6 };
    layout.font.size = 11;
    if (layout.height > 500 && layout.yaxis.scaleanchor) layout.height = 400;
    return layout;
  }

  const config = {
    responsive: true,
    displaylogo: false,
    displayModeBar: touch ? false : "hover",
    // Named one by one: some versions of plotly.js add a button of their own that sends the data to a server.
    modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["resetScale2d"]],
    showSendToCloud: false,
    plotlyServerURL: "",
    toImageButtonOptions: { format: "png", scale: 2 },
  };

  const drawn = [];
  let following = false;

  // A time that is zoomed into in one figure is shown by all of them.
  function follow(div, change) {
    if (following || !div.dataset.time) return;
    const range = change["xaxis.range[0]"] !== undefined ? [change["xaxis.range[0]"], change["xaxis.range[1]"]] : null;
    if (!range && !change["xaxis.autorange"] && !change["xaxis.range"]) return;
    following = true;
    const others = drawn.filter((d) => d !== div && d.dataset.time);
    const update = range ? { "xaxis.range": range } : { "xaxis.autorange": true };
    Promise.all(others.map((d) => Plotly.relayout(d, update))).finally(() => { following = false; });
  }

  function draw(div) {
    const { data, layout } = unpack(figures[div.id]);
    // A finger has to scroll the page, so there it does not zoom.
    const drag = touch || narrow() ? false : "zoom";
    return Plotly.newPlot(div, data, { ...fitted(layout), dragmode: drag }, config).then(() => {
      div.style.minHeight = "";
      drawn.push(div);
      div.on("plotly_relayout", (change) => follow(div, change));
      document.documentElement.dataset.drawn = String(drawn.length);
    });
  }

  // One figure at a time, from the top, so that the page can be read while the rest is drawn.
  async function drawAll() {
    for (const div of document.querySelectorAll(".figure[id]")) {
      await draw(div);
      await new Promise((resume) => setTimeout(resume, 0));
    }
    document.documentElement.dataset.complete = "yes";
  }

  const PAPER_PX = 700;
  window.addEventListener("beforeprint", () => {
    for (const div of drawn) Plotly.relayout(div, { width: div.closest(".pair") ? PAPER_PX / 2 - 12 : PAPER_PX });
  });
  window.addEventListener("afterprint", () => {
    for (const div of drawn) Plotly.relayout(div, { width: null, autosize: true });
  });

  drawAll();
})();
