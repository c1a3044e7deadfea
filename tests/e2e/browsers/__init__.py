"""Real VRML97 browsers, run headless over emitted databases.

`view3dscene` (Debian, under Xvfb) checks every file and takes pictures; `x_ite` (npm, in headless
Chromium) takes pictures. Each function returns what the browser complained about.
"""
