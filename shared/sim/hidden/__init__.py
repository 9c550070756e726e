"""The other simulator: robots with something wrong about them, for tests of identification.

What is hidden here enters, where that can be, by another way than the one by which identification
looks for it; and at a finer time step.
"""
