"""A street of houses, trees and cars, and a car with cameras that drives through it."""
