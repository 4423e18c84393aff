// What a page offers to whoever reads it: pictures, tables and numbers to keep, commands to copy. Without scripts
// the page is whole, these buttons are missing.
(() => {
  const named = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
  const title = named(document.title);

  const button = (words, what, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.className = "keep";
    made.textContent = words;
    made.title = what;
    made.addEventListener("click", () => act(made));
    return made;
  };

  const keep = (name, url) => {
    const link = document.createElement("a");
    link.href = url;
    link.download = name;
    document.body.append(link);
    link.click();
    link.remove();
  };
  const keepText = (name, kind, parts) => {
    const url = URL.createObjectURL(new Blob(parts, { type: kind }));
    keep(name, url);
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  };

  const copy = async (text, by) => {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    const words = by.textContent;
    by.textContent = "copied";
    setTimeout(() => { by.textContent = words; }, 1200);
  };

  const unpacked = async (packed) => {
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  };

  document.querySelectorAll("figure").forEach((figure, k) => {
    const image = figure.querySelector("img");
    const caption = figure.querySelector("figcaption");
    if (!image || !caption) return;
    const name = `${title}-${k + 1}`;
    const drawn = figure.querySelector("script.svg");
    const tools = document.createElement("span");
    tools.className = "keeps";
    tools.append(button("PNG", "keep this picture", () => keep(`${name}.png`, image.src)));
    if (drawn && "DecompressionStream" in window) {
      tools.append(button("SVG", "keep this picture as a drawing that scales", async () =>
        keepText(`${name}.svg`, "image/svg+xml", [await unpacked(drawn.textContent)])));
    }
    caption.append(" ", tools);
    image.addEventListener("click", () => figure.classList.toggle("large"));
  });

  // a place is three numbers, for whoever goes on with them
  const apart = (text) => {
    if (text === "at x, y, z [mm]") return ["x [mm]", "y [mm]", "z [mm]"];
    return /^-?[\d.]+(, -?[\d.]+){2}$/.test(text) ? text.split(", ") : [text];
  };
  const cell = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  document.querySelectorAll(".scroll > table").forEach((table, k) => {
    const rows = () => [...table.rows].map((row) => [...row.cells].flatMap((c) => apart(c.textContent.trim())));
    const presses = table.closest("details.presses");
    const name = presses ? `${title}-presses.csv` : `${title}-table-${k + 1}.csv`;
    const csv = () => rows().map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n";
    const tools = document.createElement("p");
    tools.className = "keeps";
    tools.append(
      button("CSV", "keep this table", () => keepText(name, "text/csv", [csv()])),
      button("copy", "copy this table, for a spreadsheet", (by) => copy(rows().map((r) => r.join("\t")).join("\n"), by)),
    );
    table.parentElement.after(tools);
  });

  document.querySelectorAll("code.command").forEach((code) => {
    code.after(button("copy", "copy this command", (by) => copy(code.textContent, by)));
  });

  // chapters: a link to what is folded away opens it, a print shows all, a long page shows its contents
  const chapters = [...document.querySelectorAll("details.chapter")], nav = document.querySelector("nav.contents");
  const LONG_PX = 3000;
  const unfold = (hash) => {
    const found = hash.length > 1 && document.getElementById(decodeURIComponent(hash.slice(1)));
    for (let at = found; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
    if (found) found.scrollIntoView();
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#"]');
    if (link) unfold(link.getAttribute("href"));
  });
  unfold(location.hash);
  let shut = [];
  addEventListener("beforeprint", () => {
    shut = chapters.filter((chapter) => !chapter.open);
    shut.forEach((chapter) => { chapter.open = true; });
  });
  addEventListener("afterprint", () => shut.forEach((chapter) => { chapter.open = false; }));
  const measure = () => { if (nav) nav.hidden = document.documentElement.scrollHeight <= LONG_PX; };
  chapters.forEach((chapter) => chapter.addEventListener("toggle", measure));
  addEventListener("load", measure);

  const result = document.querySelector("script.result");
  if (result) {
    const tools = document.createElement("p");
    tools.className = "keeps whole";
    tools.append(button("all numbers (JSON)", "keep what the command's --json writes", () =>
      keepText(`${title}.json`, "application/json", [result.textContent])));
    tools.append(button("print", "print this page", () => window.print()));
    document.querySelector("footer").before(tools);
  }
})();
