"""What the people at both pages do next, as scripts for the pages."""

CLICK = """(...selectors) => {
  for (const selector of selectors) {
    const found = document.querySelector(selector);
    if (found && found.checkVisibility() && !found.matches(":disabled, :checked")) found.click();
  }
}"""
TAKE_PART = f"""() => {{
  document.querySelector(".paper")?.scrollTo(0, 1e6);
  ({CLICK})(".tick input", "[data-item=fun] label:nth-child(4) input",
    ".rank:nth-of-type(2) label:nth-of-type(1) input",
    ".rank:nth-of-type(3) label:nth-of-type(2) input", ".form .main", "#button");
  return window.study?.view()?.screen ?? "";
}}"""
"""Fills in what is there, ranks later sections higher, presses the button; returns the screen."""
LEAD = f"""() => {{
  const mode = window.study?.view()?.gate.mode;
  if (mode === "disarmed") ({CLICK})("#arm");
  if (mode === "tripped") ({CLICK})("#reset");
  ({CLICK})("#begin");
}}"""
"""Arms the robot and begins what waits to be begun."""
