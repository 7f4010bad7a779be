"""The paper's recorder: a turntable and a contactor, force-controlled without a force sensor."""
