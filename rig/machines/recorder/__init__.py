"""The paper's recorder: law and observers in C, simulated mechanics, driver, sensors, plans that go
on.
"""
