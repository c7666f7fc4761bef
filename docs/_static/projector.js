// Keys of a projector page: a slide on, a slide back. Widgets keep their own keys.
"use strict";

const STEPS = { ArrowRight: 1, ArrowDown: 1, PageDown: 1, " ": 1, ArrowLeft: -1, ArrowUp: -1, PageUp: -1 };
addEventListener("keydown", (event) => {
    const step = STEPS[event.key], slides = [...document.querySelectorAll("main.projector > section > section")];
    if (!step || event.target.closest(".widget")) return;
    event.preventDefault();
    const shown = Math.round(scrollY / innerHeight);
    slides[Math.max(0, Math.min(slides.length - 1, shown + step))].scrollIntoView({ behavior: "instant" });
});
