// Draws the newest states of a flight. Names and units are those of the channels of flight.mcap.
window.live = (() => {
  const KEPT_S = 30, G = 9.80665;
  let frames = [], fence = {radius_m: 50, polygon_m: [], max_tilt_deg: 35}, over = null, dirty = true;

  const element = name => document.getElementById("live-" + name);
  const color = name => getComputedStyle(document.body).getPropertyValue("--" + name).trim();
  const known = value => typeof value === "number" && isFinite(value);
  const fixed = (value, digits, unit) => known(value) ? value.toFixed(digits) + " " + unit : "–";

  function canvas(name) {
    const node = element(name);
    if (!node || !node.clientWidth) return null;
    const scale = window.devicePixelRatio || 1, width = node.clientWidth, height = node.clientHeight;
    if (node.width !== Math.round(width * scale)) {
      node.width = Math.round(width * scale); node.height = Math.round(height * scale);
    }
    const pen = node.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px sans-serif"; pen.lineWidth = 1.5;
    return {pen, width, height};
  }
  function line(pen, points, name, dash = []) {
    pen.strokeStyle = color(name); pen.setLineDash(dash); pen.beginPath();
    let down = false;
    for (const [x, y] of points) {
      if (!known(x) || !known(y)) { down = false; continue; }
      if (down) pen.lineTo(x, y); else pen.moveTo(x, y);
      down = true;
    }
    pen.stroke(); pen.setLineDash([]);
  }
  function circle(pen, x, y, radius, name, filled) {
    pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI);
    if (filled) { pen.fillStyle = color(name); pen.fill(); } else { pen.strokeStyle = color(name); pen.stroke(); }
  }
  function cross(pen, x, y, name) { line(pen, [[x - 6, y], [x + 6, y]], name); line(pen, [[x, y - 6], [x, y + 6]], name); }

  function drawHorizon(now) {
    const c = canvas("horizon");
    if (!c || !known(now.q_w)) return;
    const {pen, width, height} = c, [w, x, y, z] = [now.q_w, now.q_x, now.q_y, now.q_z];
    const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
    const pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))));
    const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
    const radius = Math.min(width, height) / 2 - 14, perRadian = radius / 0.9;
    pen.save(); pen.translate(width / 2, height / 2);
    pen.beginPath(); pen.arc(0, 0, radius, 0, 2 * Math.PI); pen.clip();
    pen.rotate(-roll);
    pen.fillStyle = "#5b9bd5"; pen.fillRect(-2 * radius, -2 * radius, 4 * radius, 2 * radius + pitch * perRadian);
    pen.fillStyle = "#8a6a45"; pen.fillRect(-2 * radius, pitch * perRadian, 4 * radius, 3 * radius);
    pen.strokeStyle = "#fff"; pen.lineWidth = 1;
    for (let degrees = -40; degrees <= 40; degrees += 10) {
      const at = (pitch + degrees * Math.PI / 180) * perRadian, half = degrees ? 22 : radius;
      pen.beginPath(); pen.moveTo(-half, at); pen.lineTo(half, at); pen.stroke();
    }
    pen.restore();
    pen.save(); pen.translate(width / 2, height / 2); pen.lineWidth = 3;
    line(pen, [[-40, 0], [-12, 0], [0, 8], [12, 0], [40, 0]], "ink");
    pen.restore();
    pen.fillStyle = color("ink");
    const degrees = angle => (angle * 180 / Math.PI).toFixed(0) + "°";
    pen.fillText(`roll ${degrees(roll)}  pitch ${degrees(pitch)}  heading ${degrees((yaw + 2 * Math.PI) % (2 * Math.PI))}`, 2, height - 2);
  }
  function drawDisc(now) {
    const c = canvas("disc");
    if (!c) return;
    const {pen, width, height} = c, radius = Math.min(width, height) / 2 - 14, x0 = width / 2, y0 = height / 2;
    const most = Math.sin(fence.max_tilt_deg * Math.PI / 180), full = 1.15 * most;
    const at = (north, east) => [x0 + radius * east / full, y0 - radius * north / full];
    circle(pen, x0, y0, radius * most / full, "b", false);
    for (const share of [1 / 3, 2 / 3]) circle(pen, x0, y0, share * radius * most / full, "line", false);
    line(pen, [[x0 - radius, y0], [x0 + radius, y0]], "line"); line(pen, [[x0, y0 - radius], [x0, y0 + radius]], "line");
    pen.fillStyle = color("soft"); pen.fillText("N", x0 + 3, y0 - radius + 8); pen.fillText("E", x0 + radius - 8, y0 - 3);
    pen.fillText(`limit ${fence.max_tilt_deg.toFixed(0)}°`, 2, height - 2);
    line(pen, frames.slice(-30).map(f => at(f.measured_north, f.measured_east)), "c");
    if (known(now.measured_north)) circle(pen, ...at(now.measured_north, now.measured_east), 5, "a", true);
    if (known(now.target_north)) circle(pen, ...at(now.target_north, now.target_east), 7, "b", false);
    if (known(now.reference_north)) cross(pen, ...at(now.reference_north, now.reference_east), "ink");
  }
  function drawMap(now) {
    const c = canvas("map");
    if (!c) return;
    const {pen, width, height} = c, half = Math.min(width, height) / 2 - 8;
    const n0 = known(now.fence_north_m) ? now.fence_north_m : now.estimated_north_m;
    const e0 = known(now.fence_east_m) ? now.fence_east_m : now.estimated_east_m;
    if (!known(n0)) return;
    let reach = 5;
    for (const f of frames) for (const [n, e] of [[f.estimated_north_m, f.estimated_east_m], [f.reference_north_m, f.reference_east_m]])
      if (known(n)) reach = Math.max(reach, 1.2 * Math.hypot(n - n0, e - e0));
    const at = (n, e) => [width / 2 + half * (e - e0) / reach, height / 2 - half * (n - n0) / reach];
    pen.setLineDash([6, 4]); circle(pen, width / 2, height / 2, half * fence.radius_m / reach, "bad", false); pen.setLineDash([]);
    if (fence.polygon_m.length)
      line(pen, [...fence.polygon_m, fence.polygon_m[0]].map(([n, e]) => at(n + n0, e + e0)), "bad", [6, 4]);
    line(pen, frames.map(f => at(f.reference_north_m, f.reference_east_m)), "b");
    line(pen, frames.map(f => at(f.estimated_north_m, f.estimated_east_m)), "a");
    if (known(now.reference_north_m)) cross(pen, ...at(now.reference_north_m, now.reference_east_m), "b");
    if (known(now.estimated_north_m)) circle(pen, ...at(now.estimated_north_m, now.estimated_east_m), 5, "a", true);
    const step = Math.pow(10, Math.floor(Math.log10(reach))), bar = half * step / reach;
    line(pen, [[6, height - 6], [6 + bar, height - 6]], "ink");
    pen.fillStyle = color("soft"); pen.fillText(`${step} m`, 6, height - 10); pen.fillText("N ↑", width - 22, 12);
  }
  function drawPlot(name, series, least) {
    const c = canvas(name);
    if (!c || !frames.length) return;
    const {pen, width, height} = c, end = frames[frames.length - 1].time_s, left = 38, bottom = height - 14;
    let low = Infinity, high = -Infinity;
    for (const [, value] of series) for (const f of frames) { const v = value(f); if (known(v)) { low = Math.min(low, v); high = Math.max(high, v); } }
    if (low > high) return;
    const middle = (low + high) / 2, half = Math.max((high - low) / 2 * 1.1, least / 2);
    const x = f => left + (width - left) * (1 - (end - f.time_s) / KEPT_S), y = v => bottom / 2 + 4 - (v - middle) / half * (bottom / 2 - 4);
    pen.fillStyle = color("soft");
    for (const v of [middle - half, middle, middle + half]) {
      line(pen, [[left, y(v)], [width, y(v)]], "line");
      pen.fillText(v.toFixed(half < 1 ? 2 : 1), 0, y(v) + 4);
    }
    pen.fillText("−30 s", left, height - 1); pen.fillText("now", width - 24, height - 1);
    for (const [ink, value] of series) line(pen, frames.map(f => [x(f), value(f)]).map(([a, v]) => [a, known(v) ? y(v) : NaN]), ink);
  }
  function fill(now) {
    const cells = {
      phase: now.phase, maneuver: now.maneuver ? `${now.maneuver} ${fixed(now.maneuver_elapsed_s, 0, "s")}` : "–",
      height_m: fixed(now.height_m, 2, "m"), speed_m_s: fixed(now.speed_m_s, 2, "m/s"),
      tilt_rad: known(now.tilt_rad) ? (now.tilt_rad * 180 / Math.PI).toFixed(1) + "°" : "–",
      error_m: fixed(now.error_m, 2, "m"), rate_hz: fixed(now.rate_hz, 0, "Hz"),
      latency_us: known(now.latency_us) ? `${(now.latency_us / 1000).toFixed(2)} ms` : "–",
      frames_lost: `${now.frames_lost} lost, ${fixed(now.round_trip_ms, 1, "ms")}`,
      battery_remaining: known(now.battery_remaining) ? (100 * now.battery_remaining).toFixed(0) + " %" : "–",
      alarms: now.alarms && now.alarms.length ? "ALARM: " + now.alarms.join(", ") : now.monitored ? "ok" : "off",
    };
    for (const [name, text] of Object.entries(cells)) {
      const node = document.querySelector(`[data-live="${name}"]`);
      if (node && node.textContent !== text) { node.textContent = text; node.title = text; }
      if (node) node.classList.toggle("live-bad", text.startsWith("ALARM"));
    }
  }
  function draw() {
    if (dirty && frames.length && document.body) {
      dirty = false;
      const now = frames[frames.length - 1];
      fill(now); drawHorizon(now); drawDisc(now); drawMap(now);
      drawPlot("height", [["b", f => known(f.reference_height_m) ? f.reference_height_m : NaN], ["a", f => f.height_m]], 1);
      drawPlot("error", [["a", f => f.error_m]], 0.1);
      drawPlot("north", [["b", f => f.target_north], ["a", f => f.measured_north]], 0.05);
      drawPlot("east", [["b", f => f.target_east], ["a", f => f.measured_east]], 0.05);
      drawPlot("speed", [["a", f => f.speed_m_s]], 0.5);
      drawPlot("latency", [["a", f => known(f.latency_us) ? f.latency_us / 1000 : NaN]], 0.2);
    }
    const banner = element("over");
    if (banner && over && banner.hidden) { banner.hidden = false; banner.textContent = `${over}: the last values stay here.`; }
  }
  function addEvents(events) {
    const list = element("events");
    for (const {time_s, text} of events) {
      const item = document.createElement("li"), time = document.createElement("time");
      time.textContent = time_s.toFixed(1) + " s"; item.append(time, " " + text); list.prepend(item);
    }
    while (list && list.children.length > 200) list.lastChild.remove();
  }
  function take(state) {
    for (const f of state.frames) {
      if (frames.length && f.time_s < frames[frames.length - 1].time_s) frames = [];
      frames.push(f);
    }
    while (frames.length && frames[frames.length - 1].time_s - frames[0].time_s > KEPT_S) frames.shift();
    fence = state.fence; over = state.over || over; dirty = dirty || state.frames.length > 0;
    addEvents(state.events); draw();
  }
  window.addEventListener("resize", () => { dirty = true; draw(); });
  new MutationObserver(() => { dirty = true; draw(); }).observe(document.documentElement, {attributes: true, subtree: true, attributeFilter: ["class"]});
  return {begin: take, push: take, frames: () => frames};
})();
