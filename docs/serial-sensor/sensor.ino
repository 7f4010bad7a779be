// A sensor for tactileq: an encoder wheel (A on pin 2, B on pin 3) and a load cell's amplifier on A0.
// A sketch to start from: set the constants to your parts. docs/serial-sensor.md
#include "line.h"

const char FIRMWARE[] = "wheel and load cell 1.0"; // of this sketch; stored in the data
const float UM_PER_COUNT = 25.0;       // of the wheel, measured with a ruler
const float MN_PER_STEP = 5.0;         // of the load cell, measured with a weight
const int REST_STEPS = 512;            // the load cell without weight
const uint32_t PERIOD_US = 2000;       // 500 lines a second
const uint32_t BAUD = 500000;          // exact on a 16 MHz AVR; set baud under [hand] to the same

volatile int32_t counts = 0;
uint16_t number = 0;
uint32_t next_us;

void turned() { counts += digitalRead(2) == digitalRead(3) ? 1 : -1; }

void setup() {
  pinMode(2, INPUT_PULLUP);
  pinMode(3, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(2), turned, CHANGE);
  Serial.begin(BAUD);
  next_us = micros();
}

void loop() {
  if ((int32_t)(micros() - next_us) < 0) return;
  next_us += PERIOD_US;
  noInterrupts();
  int32_t position = counts;
  uint32_t now_us = micros();
  interrupts();
  int32_t force_mn = (int32_t)((analogRead(A0) - REST_STEPS) * MN_PER_STEP);
  char line[TQ_LINE];
  uint8_t length;
  if (number % 250 == 0) {  // twice a second
    length = tq_firmware_line(line, FIRMWARE);
    Serial.write((const uint8_t *)line, length);
  }
  length = tq_position_line(line, number++, now_us, (int32_t)(position * UM_PER_COUNT), 0, force_mn,
                            TQ_CONTACT);
  Serial.write((const uint8_t *)line, length);
}
